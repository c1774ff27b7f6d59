//! Parts that meet or fit: nothing comes apart and nothing collides.
//!
//! Parts are cut from one surface, put about origins of their own, and shown by nodes, components, instances and mirrors
//! where they belong. What meets is found and measured here, from the files alone.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::{Isometry3, Matrix4, Point3, Vector3};
use proptest::prelude::*;
use serde_json::json;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Preset, Secret};
use sombrero::{EmbedOptions, Marked, Model, embed};
use sombrero_tests::{joined, tile};
use std::io::Write;

/// A stored mesh, and where it is shown: every place in the world.
struct Part {
    soup: Soup,
    places: Vec<Matrix4<f64>>,
}

impl Part {
    fn at(soup: Soup, place: Matrix4<f64>) -> Self {
        Self { soup, places: vec![place] }
    }
}

/// A GLB with a node for each place, and lines over positions of their own.
fn glb(parts: &[Part], lines: &[Point3<f64>]) -> Vec<u8> {
    let (mut bin, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut accessor = |bytes: Vec<u8>, component: u32, count: usize, shape: &str| {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
        bin.extend(bytes);
        accessors.push(
            json!({"bufferView": views.len() - 1, "componentType": component, "count": count, "type": shape}),
        );
        accessors.len() - 1
    };
    let floats = |points: &[Point3<f64>]| -> Vec<u8> {
        points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(|x| (x as f32).to_le_bytes()).collect()
    };
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    for Part { soup, places } in parts {
        let positions = accessor(floats(&soup.points), 5126, soup.points.len(), "VEC3");
        let corners: Vec<u8> = soup.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let indices = accessor(corners, 5125, 3 * soup.triangles.len(), "SCALAR");
        meshes.push(json!({"primitives": [{"attributes": {"POSITION": positions}, "indices": indices}]}));
        for place in places {
            nodes.push(json!({"mesh": meshes.len() - 1, "matrix": place.as_slice()}));
        }
    }
    if !lines.is_empty() {
        let positions = accessor(floats(lines), 5126, lines.len(), "VEC3");
        meshes.push(json!({"primitives": [{"attributes": {"POSITION": positions}, "mode": 1}]}));
        nodes.push(json!({"mesh": meshes.len() - 1}));
    }
    let scene: Vec<usize> = (0..nodes.len()).collect();
    let root = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": scene}], "nodes": nodes, "meshes": meshes,
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": bin.len()}],
    });
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let total = 12 + 8 + text.len() + 8 + bin.len();
    [
        b"glTF".as_slice(),
        &word(2),
        &word(total),
        &word(text.len()),
        b"JSON",
        &text,
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ]
    .concat()
}

/// A 3MF with an object for each part, a component for each place, and one item.
fn threemf(parts: &[Part]) -> Vec<u8> {
    let (mut objects, mut components) = (String::new(), String::new());
    for (number, Part { soup, places }) in (1..).zip(parts) {
        let vertices: String = soup
            .points
            .iter()
            .map(|p| format!("<vertex x=\"{:.7}\" y=\"{:.7}\" z=\"{:.7}\"/>", p.x, p.y, p.z))
            .collect();
        let triangles: String = soup
            .triangles
            .iter()
            .map(|[a, b, c]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>"))
            .collect();
        objects += &format!(
            "<object id=\"{number}\" type=\"model\"><mesh><vertices>{vertices}</vertices>\
             <triangles>{triangles}</triangles></mesh></object>"
        );
        for place in places {
            let numbers: Vec<String> =
                (0..4).flat_map(|c| (0..3).map(move |r| (r, c))).map(|at| format!("{}", place[at])).collect();
            components += &format!("<component objectid=\"{number}\" transform=\"{}\"/>", numbers.join(" "));
        }
    }
    let whole = parts.len() + 1;
    let model = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\
         <model unit=\"millimeter\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>\
         {objects}<object id=\"{whole}\" type=\"model\"><components>{components}</components></object></resources>\
         <build><item objectid=\"{whole}\"/></build></model>"
    );
    let relations = "<?xml version=\"1.0\"?>\
        <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
        <Relationship Target=\"/3D/3dmodel.model\" Id=\"r\" \
        Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in [("_rels/.rels", relations), ("3D/3dmodel.model", &model)] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(content.as_bytes()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn read(bytes: Vec<u8>) -> Document {
    Document::parse(bytes, None).unwrap()
}

fn mark(original: &Document, preset: Preset, coefficients: usize) -> Marked {
    let mut options =
        EmbedOptions { parameters: preset.parameters(), fewer_if_small: true, ..EmbedOptions::default() };
    options.parameters.basis.coefficients = coefficients;
    embed(original, Secret([7; 32]), &options).unwrap()
}

/// Every vertex at every place. `places` are of the parts, in the order of the file.
fn in_the_world(document: &Document, parts: &[Part]) -> Vec<Point3<f64>> {
    let (mut world, mut start) = (Vec::new(), 0);
    for Part { soup, places } in parts {
        let shown = &document.points()[start..start + soup.points.len()];
        start += soup.points.len();
        // The document has them where they are shown first.
        let back = places[0].try_inverse().unwrap();
        for place in places {
            world.extend(shown.iter().map(|p| (place * back).transform_point(p)));
        }
    }
    world.extend(&document.points()[start..]);
    world
}

/// The widest distance, before and after, of two vertices that were within `tolerance` of each other.
fn cracks(before: &[Point3<f64>], after: &[Point3<f64>], tolerance: f64) -> [f64; 2] {
    let mut order: Vec<usize> = (0..before.len()).collect();
    order.sort_by(|&i, &j| before[i].x.total_cmp(&before[j].x));
    let mut widest = [0.0_f64; 2];
    for (n, &i) in order.iter().enumerate() {
        for &j in order[n + 1..].iter().take_while(|&&j| before[j].x - before[i].x <= tolerance) {
            if (before[i] - before[j]).norm() <= tolerance {
                widest = [
                    widest[0].max((before[i] - before[j]).norm()),
                    widest[1].max((after[i] - after[j]).norm()),
                ];
            }
        }
    }
    widest
}

/// Marks, and fails unless what met within `tolerance` is apart by at most `rounding` more than before.
fn stays_together(parts: &[Part], file: Vec<u8>, tolerance: f64, rounding: f64) -> (Document, Document) {
    let original = read(file);
    let copy = read(mark(&original, Preset::Robust, 24).bytes);
    let [before, after] = [&original, &copy].map(|document| in_the_world(document, parts));
    let moved = before.iter().zip(&after).map(|(p, q)| (q - p).norm()).fold(0.0, f64::max);
    assert!(moved > 100.0 * rounding, "the mark is {moved}");
    let [met, meet] = cracks(&before, &after, tolerance);
    assert!(meet <= met + rounding, "{met} became {meet}");
    (original, copy)
}

/// The parts of a surface on both sides of a plane, each about an origin of its own, shown where it was.
fn cut(soup: &Soup, normal: Vector3<f64>, poses: &[Isometry3<f64>; 2]) -> Vec<Part> {
    let side = |corners: &&[u32; 3]| {
        corners.iter().map(|&v| soup.points[v as usize].coords.dot(&normal)).sum::<f64>() > 0.0
    };
    let half = |upper: bool| {
        let triangles = soup.triangles.iter().filter(|t| side(t) == upper).copied().collect();
        Soup::new(soup.points.clone(), triangles).compacted().0
    };
    let part = |(upper, pose): (bool, &Isometry3<f64>)| {
        let mut soup = half(upper);
        soup.points.iter_mut().for_each(|p| *p = pose.inverse_transform_point(p));
        Part::at(soup, pose.to_homogeneous())
    };
    [true, false].into_iter().zip(poses).map(part).collect()
}

/// The part as it is in the world.
fn placed(part: &Part) -> Soup {
    let mut soup = part.soup.clone();
    soup.points.iter_mut().for_each(|p| *p = part.places[0].transform_point(p));
    soup
}

/// All parts as they are in the world, in one mesh.
fn world(parts: &[Part]) -> Soup {
    parts.iter().map(placed).reduce(|all, part| joined(&all, &part)).unwrap_or_default()
}

/// The same surface with a vertex in the middle of every open edge.
fn split_at_rims(soup: &Soup) -> Soup {
    let edges = sombrero::mesh::Edges::new(soup.points.len(), &soup.triangles);
    let mut split = Soup::new(soup.points.clone(), Vec::new());
    for (face, corners) in soup.triangles.iter().enumerate() {
        // One open edge a triangle is enough.
        let open = (0..3).find(|k| edges.sides[edges.of_side[3 * face + k] as usize] == 1);
        let Some(k) = open else {
            split.triangles.push(*corners);
            continue;
        };
        let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
        let middle = split.points.len() as u32;
        split.points.push(nalgebra::center(&soup.points[a as usize], &soup.points[b as usize]));
        split.triangles.extend([[a, middle, c], [middle, b, c]]);
    }
    split
}

fn bumpy() -> Soup {
    shapes::bumpy_sphere(700)
}

#[test]
fn a_tile_shown_side_by_side_fits_itself() {
    let places: Vec<_> =
        (0..4).map(|i| Matrix4::new_translation(&Vector3::new(f64::from(i), 0.0, 0.0))).collect();
    let parts = [Part { soup: tile(), places }];
    stays_together(&parts, glb(&parts, &[]), 1e-6, 4e-7);
    stays_together(&parts, threemf(&parts), 1e-6, 4e-7);
}

#[test]
fn a_half_and_its_mirror_image_stay_one() {
    let whole = shapes::sphere(4);
    let mut half = cut(&whole, Vector3::x(), &[Isometry3::identity(); 2]).remove(0);
    for p in &mut half.soup.points {
        *p *= 1.0 + 0.1 * (5.0 * p.y).sin() * (4.0 * p.z + 7.0 * p.x * p.x).cos();
    }
    half.places.push(Matrix4::new_nonuniform_scaling(&Vector3::new(-1.0, 1.0, 1.0)));
    let parts = [half];
    for file in [glb(&parts, &[]), threemf(&parts)] {
        let (original, copy) = stays_together(&parts, file, 1e-6, 4e-7);
        // The seam moves, within the plane of the mirror.
        let seam = |d: &Document| {
            d.points()
                .iter()
                .zip(original.points())
                .filter(|(_, p)| p.x == 0.0)
                .map(|(q, _)| *q)
                .collect::<Vec<_>>()
        };
        assert!(!seam(&copy).is_empty() && seam(&copy).iter().all(|q| q.x.abs() < 2e-7));
        assert!(seam(&copy).iter().zip(seam(&original)).any(|(q, p)| (q - p).norm() > 1e-4));
    }
}

#[test]
fn facets_whose_corners_differ_by_rounding_are_joined() {
    let clean = bumpy();
    let corners: Vec<Point3<f64>> =
        clean.triangles.iter().flatten().map(|&v| clean.points[v as usize] * 30.0).collect();
    let jitter = |i: usize, axis: usize| ((i * 3 + axis) as f64 * 0.754_877_666).fract() - 0.5;
    for amplitude in [0.0, 4e-6, 2e-5] {
        let moved = |(i, p): (usize, &Point3<f64>)| {
            Point3::from([0, 1, 2].map(|axis| p[axis] + amplitude * jitter(i, axis)))
        };
        let points: Vec<_> = corners.iter().enumerate().map(moved).collect();
        let triangles = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let original = read(encode(Format::StlBinary, &Soup::new(points, triangles)).unwrap());
        let marked = mark(&original, Preset::Robust, 24);
        let copy = read(marked.bytes);
        let [before, after] = cracks(original.points(), copy.points(), 6e-5);
        assert!(after <= before + 2e-5, "{amplitude}: {before} became {after}");
        assert_eq!(
            Model::of_scene(original.soup(), &original.scene()).soup().points.len(),
            clean.points.len()
        );
        assert!(
            marked.report.log10_p_after_noise < -10.0,
            "{amplitude}: {}",
            marked.report.log10_p_after_noise
        );
    }
}

#[test]
fn points_on_the_edges_of_another_part_stay_on_them() {
    let mut parts = cut(&bumpy(), Vector3::z(), &[Isometry3::identity(); 2]);
    parts[1].soup = split_at_rims(&parts[1].soup);
    let whole = world(&parts);
    let original = read(encode(Format::Obj, &whole).unwrap());
    let copy = read(mark(&original, Preset::Robust, 24).bytes);
    let hanging = hanging(&whole);
    assert!(hanging.len() > 20);
    for (v, [a, b]) in hanging {
        let at = |v: u32| copy.points()[v as usize];
        assert!((at(v) - nalgebra::center(&at(a), &at(b))).norm() < 1e-12, "{v}");
    }
    let [before, after] = cracks(original.points(), copy.points(), 1e-9);
    assert!(after <= before + 1e-12, "{after}");
}

/// Vertices in the middle of open edges, and the ends of those.
fn hanging(soup: &Soup) -> Vec<(u32, [u32; 2])> {
    let edges = sombrero::mesh::Edges::new(soup.points.len(), &soup.triangles);
    let open = edges.ends.iter().zip(&edges.sides).filter(|(_, sides)| **sides == 1);
    let on = |ends: &[u32; 2]| {
        let middle = nalgebra::center(&soup.points[ends[0] as usize], &soup.points[ends[1] as usize]);
        let v = soup.points.iter().position(|p| (p - middle).norm() < 1e-12)?;
        Some((v as u32, *ends))
    };
    open.filter_map(|(ends, _)| on(ends)).collect()
}

#[test]
fn lines_go_along_with_the_surface_that_they_are_drawn_on() {
    let surface = bumpy();
    let at_vertices: Vec<Point3<f64>> = surface.points[..200].to_vec();
    let within: Vec<Point3<f64>> = surface.triangles[..200]
        .iter()
        .map(|t| {
            Point3::from(t.iter().map(|&v| surface.points[v as usize].coords).sum::<Vector3<f64>>() / 3.0)
        })
        .collect();
    let lines = [at_vertices, within].concat();
    let parts = [Part::at(surface.clone(), Matrix4::identity())];
    let (_, copy) = stays_together(&parts, glb(&parts, &lines), 1e-6, 4e-7);
    let drawn = &copy.points()[surface.points.len()..];
    assert_eq!(drawn.len(), 400);
    for (q, corners) in drawn[200..].iter().zip(&surface.triangles) {
        let centre = corners.iter().map(|&v| copy.points()[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        assert!((q.coords - centre).norm() < 1e-6);
    }
}

/// A rigid motion from numbers of -1 to 1.
fn pose([x, y, z, a, b, c]: [f64; 6]) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(x, y, z) * 3.0, Vector3::new(a, b, c) * 2.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn assemblies_hold_in_every_format(
        normal in prop::array::uniform3(-1.0..1.0_f64),
        poses in prop::array::uniform2(prop::array::uniform6(-1.0..1.0_f64)),
        hanging in any::<bool>(),
        again in prop::option::of(prop::array::uniform6(-1.0..1.0_f64)),
        format in 0..4_usize,
    ) {
        let normal = Vector3::from(normal);
        prop_assume!(normal.norm() > 0.1);
        let mut parts = cut(&bumpy(), normal, &poses.map(pose));
        if hanging {
            parts[0].soup = split_at_rims(&parts[0].soup);
        }
        let world = world(&parts);
        match format {
            0 | 1 => {
                if let Some(again) = again {
                    let again = pose(again).to_homogeneous() * parts[1].places[0];
                    parts[1].places.push(again);
                }
                let file = if format == 0 { glb(&parts, &[]) } else { threemf(&parts) };
                stays_together(&parts, file, 4e-6, 2e-6);
            }
            _ => {
                let format = [Format::Obj, Format::StlBinary][format - 2];
                stays_together(&[], encode(format, &world).unwrap(), 1e-6, 1e-6);
            }
        }
    }
}
