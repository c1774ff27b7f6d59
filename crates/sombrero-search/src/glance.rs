//! The first look at a suspect: whether it is another shape.
//!
//! It sees shapes alone, no basis and no w, and takes a second where a basis may take ten. A suspect is another shape when
//!
//! - no numbering of its vertices fits the original's connectivity,
//! - in no pose that registration found, upright, mirrored or stretched, the two surfaces have a quarter of them in common,
//! - none of its components fits the original either,
//! - and it does not lie on the original as it is.
//!
//! Then nothing is compared and p is 1. An original of several parts gets no such look: each of them might be what the suspect
//! shows, and saying that none is takes as long as the search.

use crate::budget::Budget;
use crate::error::SearchError;
use crate::matched::{Matched, matched};
use crate::options::{SearchOptions, When};
use crate::outline::Outline;
use crate::parts::{PartShape, components};
use crate::placements;
use crate::poses::{Similar, lies_elsewhere, mirrored, similar, stretched};
use crate::stages::Stages;
use crate::suspect::Suspect;
use nalgebra::Affine3;

/// What the first look saw, which the search need not look at again.
#[derive(Debug)]
pub struct Glance {
    another_shape: bool,
    /// Started with this look.
    pub(crate) budget: Budget,
    /// The numberings that fit the connectivity, if they were looked for.
    pub(crate) matched: Option<Matched>,
    /// The poses that fit, if they were looked for; and where they fit badly, those of the mirror image and the affine ones.
    pub(crate) similar: Option<Similar>,
    pub(crate) mirrored: Option<Vec<Affine3<f64>>>,
    pub(crate) stretched: Option<Option<Vec<Affine3<f64>>>>,
    /// Seconds by stage.
    pub seconds: Stages,
}

impl Glance {
    /// What users are told of another shape.
    pub const ANOTHER_SHAPE: &'static str =
        "The suspect fits the original badly in every pose that was tried; it may be another shape.";

    /// Whether the suspect is another shape, so that there is nothing to be compared.
    pub fn is_another_shape(&self) -> bool {
        self.another_shape
    }
}

pub(crate) fn glance(
    outline: &Outline,
    suspect: &Suspect,
    options: &SearchOptions,
) -> Result<Glance, SearchError> {
    let mut seen = Glance {
        another_shape: false,
        budget: Budget::new(options.budget),
        matched: None,
        similar: None,
        mirrored: None,
        stretched: None,
        seconds: Stages::default(),
    };
    let may_compare = options.registration != When::Never && options.resampling != When::Never;
    if may_compare && suspect.correspondence.is_none() && !outline.has_parts() {
        seen.another_shape = seen.tells_apart(outline, suspect, options)?;
    }
    Ok(seen)
}

impl Glance {
    fn tells_apart(
        &mut self,
        outline: &Outline,
        suspect: &Suspect,
        options: &SearchOptions,
    ) -> Result<bool, SearchError> {
        let (soup, seconds) = (&suspect.soup, &mut self.seconds);
        if options.resampling != When::Always && !suspect.cloud {
            let found = seconds.time("matching", || matched(outline.model(), soup));
            let found = self.matched.insert(found);
            if !found.ways.is_empty() {
                return Ok(false);
            }
        }
        let upright = self.similar.insert(similar(outline, soup, options.registration, seconds)?);
        if !upright.is_apart() {
            return Ok(false);
        }
        if options.registration == When::Auto && lies_elsewhere(outline, soup, &upright.poses())? {
            return Ok(false);
        }
        let image = self.mirrored.insert(mirrored(outline, soup, upright.limit_of_mirror_image(), seconds));
        if !image.is_empty() {
            return Ok(false);
        }
        let affine = self.stretched.insert(stretched(outline, soup, seconds));
        Ok(affine.is_none() && !has_parts_of(outline, suspect, seconds))
    }
}

/// Whether a component of the suspect, where it has several, fits the original.
fn has_parts_of(outline: &Outline, suspect: &Suspect, seconds: &mut Stages) -> bool {
    let components = if suspect.cloud { Vec::new() } else { components(&suspect.soup) };
    if components.len() < 2 {
        return false;
    }
    let own = crate::parts::components(outline.model().soup());
    let shapes: Vec<PartShape> = own.into_iter().filter_map(PartShape::new).collect();
    let shapes: Vec<&PartShape> = shapes.iter().collect();
    !seconds.time("matching", || placements::by_vertices(&shapes, &components)).is_empty()
        || !seconds.time("registration", || placements::by_surfaces(&shapes, &components)).is_empty()
}
