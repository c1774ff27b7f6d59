//! 3MF: models as XML in a ZIP archive.
//!
//! *Read:* the model that the package's relationships name and the parts that it refers to by the production
//! extension; in them the vertices and triangles of every object that the build shows, through any depth of
//! components. Each mesh comes once, where the first path from the build puts it; further instances are counted.
//! Without a build, every mesh is read where it is stored.
//!
//! *Kept:* all else, to the byte. Only the values of `x`, `y` and `z` of vertices that moved are spelled anew;
//! parts without such a vertex stay packed as they are, and of the archive only sizes, checksums and offsets of
//! what changed. Supports, what slicers never print, objects that the build does not show, and objects that it flattens are
//! left alone and noted. The unit is not applied.
//!
//! *Refused:* encryption (of the archive or by the Secure Content extension), other compression than Deflate,
//! UTF-16, document type declarations, archives in which two entries share bytes or names with a model part,
//! components that contain themselves, and archives that unpack to far more than they weigh.

mod archive;
mod build;
mod directory;
mod fields;
mod model;
mod package;
mod packing;
mod roles;
mod scene;
#[cfg(test)]
mod tests;
mod write;
mod xml;

use std::borrow::Cow;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::coordinate::is_finite;
use crate::error::ParseError;
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::Source;
use crate::notes::unmarked;
use crate::parsed::Parsed;
use archive::Budget;
use model::{Findings, Part};
use package::Package;
use roles::Roles;
use scene::{Placed, Scene, Trouble};
use write::{Layout, PartLayout};

/// The format's row.
pub(crate) static FAMILY: Family = Family {
    name: "3MF",
    variants: &[&ARCHIVE],
    recognise: |bytes| Evidence::Certain.when(is_zip(bytes)),
    parse,
    empty: ParseError::NothingShown,
};

/// A ZIP archive, the only way to write it.
pub(crate) static ARCHIVE: Variant = Variant {
    format: Format::ThreeMf,
    name: "3MF",
    extension: "3mf",
    needs_triangles: true,
    encode: write::encode,
};

/// Whether the bytes are a ZIP archive.
fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let package = Package::open(bytes)?;
    let mut budget = Budget::new(limits.unpacked(bytes.len()));
    let (entry, signed) = package.model(&mut budget)?;
    let mut findings = Findings::default();
    let mut parts = model::read(&package, entry, &mut budget, limits, &mut findings)?;
    let roles = Roles::read(&package, &mut budget);
    roles.apply(&mut parts);
    show_something(&mut parts);
    package.note(&mut findings.attributes);
    if signed {
        findings.notes.note("The digital signature no longer holds once positions change.");
    }
    let scene = scene::read(&parts).map_err(|trouble| located(&package, &parts, trouble))?;
    Ok(assemble(parts, scene, &roles, findings))
}

/// Where nothing is a model, or no item is printed, what is not printed elsewhere is all there is to show.
fn show_something(parts: &mut [Part]) {
    if let Some(root) = parts.first_mut().filter(|root| root.items.is_empty()) {
        root.items = std::mem::take(&mut root.unprinted);
    }
    if parts.iter().flat_map(|part| &part.objects).all(|object| !object.is_model()) {
        parts.iter_mut().flat_map(|part| &mut part.objects).for_each(|object| object.unprinted = false);
    }
}

/// An error with its line, for which the text has to be unpacked again.
fn located(package: &Package<'_>, parts: &[Part], trouble: Trouble) -> ParseError {
    let Trouble { part, at, problem } = trouble;
    let entry = parts.get(part).map_or(usize::MAX, |part| part.entry);
    let text = package.archive.unpack(entry, &mut Budget::new(u64::MAX)).unwrap_or(Cow::Borrowed(&[]));
    ParseError::Malformed { place: xml::place(&package.archive.title(entry), &text, at), problem }
}

/// Puts the meshes together that can be shown and moved.
fn assemble(parts: Vec<Part>, scene: Scene, roles: &Roles, findings: Findings) -> Parsed {
    let Findings { attributes, notes } = findings;
    let mut notes = notes.into_names();
    let (mut soup, mut layout) = (Soup::default(), Layout::default());
    let (mut repeated, mut unusable, mut places) = (0_u64, 0, Vec::new());
    let mut unprinted = scene.unprinted;
    let hidden = match parts.first() {
        Some(root) if !root.unprinted.is_empty() => "that the build does not show, or says not to print,",
        _ => "that the build does not show",
    };
    let mut placed = scene.placed.into_iter().peekable();
    for (number, part) in parts.into_iter().enumerate() {
        let mut place = PartLayout { entry: part.entry, slots: Vec::new(), blocks: Vec::new() };
        while let Some(mesh) = placed.next_if(|mesh| mesh.part == number) {
            let first = soup.points.len() as u32;
            let (id, count) = part.objects.get(mesh.object).map_or((0, 0), |o| (o.id, o.triangles.len()));
            let of_root = (number == 0).then(|| roles.unprinted(id, count)).flatten();
            match append(&mut soup, &mut place, &part, &mesh, of_root.as_deref()) {
                Some(triangles) => {
                    unprinted += of_root.map_or(0, |_| roles.volumes(id));
                    let vertices = first..soup.points.len() as u32;
                    let shown = mesh
                        .placement
                        .iter()
                        .flat_map(|p| mesh.further.iter().map(|f| f.after(p, vertices.clone())));
                    places.extend(shown);
                    let more = mesh.times.saturating_sub(1).saturating_mul(triangles as u64);
                    repeated = repeated.saturating_add(more);
                }
                None => unusable += 1,
            }
        }
        layout.parts.push(place);
    }
    let objects = |count, which| unmarked(count, ["object", "objects"], which);
    notes.extend(objects(scene.hidden, hidden));
    notes.extend(objects(scene.supports, "for support"));
    let volumes = ["volume of a slicer", "volumes of a slicer"];
    notes.extend(unmarked(unprinted, volumes, "(modifier, negative or for supports)"));
    notes.extend(objects(unusable, "that the build flattens or puts out of all bounds"));
    Parsed {
        repeated_triangles: repeated,
        places,
        notes,
        ..Parsed::new(Format::ThreeMf, soup, attributes, layout)
    }
}

/// Appends a mesh where it is shown and returns how many triangles it has; `None` if it cannot be shown. Triangles that are
/// not printed are left out, and their vertices have no face.
fn append(
    soup: &mut Soup,
    place: &mut PartLayout,
    part: &Part,
    mesh: &Placed,
    unprinted: Option<&[bool]>,
) -> Option<usize> {
    let placement = mesh.placement?;
    let object = part.objects.get(mesh.object)?;
    let (points, triangles) =
        (part.points.get(object.points.clone())?, part.triangles.get(object.triangles.clone())?);
    let slots = part.slots.get(object.points.clone())?;
    let start = soup.points.len();
    let first = u32::try_from(start).ok()?;
    soup.points.extend(points.iter().map(|point| placement.world(point)));
    let moved_away = |(stored, shown): (&Point3<f64>, &Point3<f64>)| is_finite(stored) && !is_finite(shown);
    if points.iter().zip(soup.points.iter().skip(start)).any(moved_away) {
        soup.points.truncate(start);
        return None;
    }
    let before = soup.triangles.len();
    let is_printed = |i: usize| unprinted.is_none_or(|unprinted| unprinted.get(i) != Some(&true));
    let printed = triangles.iter().enumerate().filter(|(i, _)| is_printed(*i));
    soup.triangles.extend(printed.map(|(_, corners)| corners.map(|corner| first + corner)));
    place.slots.extend_from_slice(slots);
    place.blocks.push((points.len(), placement));
    Some(soup.triangles.len() - before)
}
