//! The looks at a suspect, and the routes of each, in order: vertices first, which are quick and exact, surfaces when those do
//! not settle it; the whole, its mirror image, its parts, the whole through a warp.
//!
//! What there is to look at, the shapes decide alone. Where the vertices of parts say that each was moved by itself, that is
//! looked at first; a mirror image, where it fits and the suspect itself does not. Else they come when the usual look found nothing.

use crate::budget::Budget;
use crate::by_parts::{FoundPart, by_parts};
use crate::error::SearchError;
use crate::examiner::{Examiner, Look};
use crate::glance::Glance;
use crate::limits::MOST_POSES;
use crate::matched::matched;
use crate::nuisances::{NUISANCES, QUICK, WARP};
use crate::options::{SearchOptions, When};
use crate::original::Original;
use crate::parts::{Component, PartShape, are_alike, components};
use crate::placements::{self, Found};
use crate::poses::{mirrored, poses, similar, stretched};
use crate::stages::Stages;
use crate::surfaces::by_surfaces;
use crate::suspect::Suspect;
use crate::tally::Tally;
use crate::vertices::{Correspondence, by_vertices};
use nalgebra::Affine3;
use sombrero_mesh::Soup;

/// Correspondences that are further off than this, in largest sides of what was found, are those of other parts where each part
/// has its own.
const HOPELESS: f64 = 0.05;

/// Poses that are tried of a shape that has endlessly many, so that next to none of those tried can be right.
const SOME: usize = 12;
/// Poses, or correspondences, that are looked at through a warp, which takes seconds each.
const FEW: usize = 2;
/// What is said of such a shape.
const ENDLESS: &str = "The original goes onto itself in endlessly many ways, as balls and bodies of revolution do, \
                       and no fit tells which of them is right: few were tried. Where vertices and triangles are \
                       kept the mark is found as a rule; else put the suspect onto the original by hand and take it \
                       as it is (registration never).";

/// A search that is over.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SearchOutcome<E> {
    /// What the suspect was taken for, in order: one at least, unless it is another shape. The smallest corrected p of all looks is
    /// the answer.
    pub looks: Vec<Looked<E>>,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
    /// Whether [`SearchOptions::budget`] ran out before all was looked at.
    pub budget_spent: bool,
}

/// One look that is over.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Looked<E> {
    /// What the suspect was taken for.
    pub look: Look,
    /// Who was shown every estimate.
    pub examiner: E,
    /// The number of tests that the best p of this look is to be corrected for: those made, those left out because one was
    /// certain, and what other looks that might follow cost.
    pub counted: usize,
    /// Where parts were found that were placed one by one.
    pub parts: Vec<FoundPart>,
}

/// Shows the examiner an estimate for every hypothesis that the shapes permit, until one is certain. `examiner` has seen
/// nothing; each look gets a clone.
///
/// # Errors
/// [`SearchError`](crate::SearchError) when no hypothesis can be examined or a step that was insisted on cannot be taken; and
/// what the examiner fails with.
pub fn search<E: Examiner>(
    original: &Original,
    suspect: &Suspect,
    options: &SearchOptions,
    examiner: E,
) -> Result<SearchOutcome<E>, E::Error> {
    search_from(original.outline().glance(suspect, options)?, original, suspect, options, examiner)
}

/// [`search`] that goes on from the first look at this suspect with these options.
///
/// # Errors
/// As [`search`].
pub fn search_from<E: Examiner>(
    mut glance: Glance,
    original: &Original,
    suspect: &Suspect,
    options: &SearchOptions,
    examiner: E,
) -> Result<SearchOutcome<E>, E::Error> {
    let seconds = std::mem::take(&mut glance.seconds);
    let mut done = SearchOutcome { looks: Vec::new(), seconds, warnings: Vec::new(), budget_spent: false };
    if glance.is_another_shape() {
        done.warnings.push(Glance::ANOTHER_SHAPE.to_owned());
        return Ok(done);
    }
    let budget = glance.budget;
    let mut search = Search {
        original,
        suspect,
        options,
        budget,
        glance,
        examiner,
        corresponding: Vec::new(),
        poses: Vec::new(),
        found: false,
        clear: false,
        done,
    };
    search.all()?;
    let done = search.done;
    if !done.looks.is_empty() {
        Ok(done)
    } else if done.warnings.is_empty() {
        Err(SearchError::NeedsResampling.into())
    } else {
        Err(SearchError::NothingWorked { reasons: done.warnings.join(" ") }.into())
    }
}

struct Search<'a, E> {
    original: &'a Original,
    suspect: &'a Suspect,
    options: &'a SearchOptions,
    budget: Budget,
    /// What the first look found; taken where it is used.
    glance: Glance,
    examiner: E,
    /// Where the suspect may lie, for a look that comes later: vertices that correspond, and poses of its surface.
    corresponding: Vec<Correspondence>,
    poses: Vec<Affine3<f64>>,
    /// Whether one of those that are over found the mark, and whether clearly.
    found: bool,
    clear: bool,
    /// Those that are over.
    done: SearchOutcome<E>,
}

impl<'a, E: Examiner> Search<'a, E> {
    fn all(&mut self) -> Result<(), E::Error> {
        let mut whole = self.tally(Look::Whole);
        let certain = self.first(&mut whole)?;
        let seen_in_time = self.is_spent() && !self.done.looks.is_empty();
        if !certain && whole.is_open() && !seen_in_time {
            self.by_surfaces(&mut whole)?;
        }
        let shared = whole.is_shared();
        self.close(whole, Vec::new());
        if shared && !self.clear { self.look_through_a_warp() } else { Ok(()) }
    }

    /// Looks for finer warps where vertices correspond or surfaces fit.
    fn look_through_a_warp(&mut self) -> Result<(), E::Error> {
        if self.is_spent() {
            return Ok(());
        }
        let mut tally = self.tally(Look::Warped);
        if self.corresponding.is_empty() {
            by_surfaces(self.original, self.suspect, &self.poses, &WARP, &mut tally)?;
        } else {
            by_vertices(self.original, &self.corresponding, &WARP, &mut tally)?;
        }
        self.close(tally, Vec::new());
        Ok(())
    }

    /// Whether the time is over; noted where it is.
    fn is_spent(&mut self) -> bool {
        self.done.budget_spent |= self.budget.is_spent();
        self.done.budget_spent
    }

    /// Vertices, and those of parts. Whether all is said: one that is not the whole is certain, or the vertices of all parts tell where
    /// they are.
    fn first(&mut self, whole: &mut Tally<'a, E>) -> Result<bool, E::Error> {
        if self.options.resampling == When::Always {
            return Ok(false);
        }
        if self.suspect.cloud {
            // Points have no connectivity that could be matched.
            whole.take(0);
            return Ok(false);
        }
        let mut correspondences = self.correspondences(whole);
        let fits = correspondences.iter().any(Correspondence::fits);
        let mut all_placed = false;
        if fits && self.suspect.correspondence.is_some() {
            whole.close_all();
        }
        if !fits && whole.is_shared() {
            let components = self.components();
            let shapes = self.shapes_of_parts(&components);
            let found = whole.seconds.time("matching", || placements::by_vertices(&shapes, &components));
            if !found.is_empty() {
                all_placed = found.len() == components.len();
                if self.look_at_parts(found)? {
                    return Ok(true);
                }
                // One connectivity for all parts misleads the whole.
                correspondences.retain(|correspondence| correspondence.is_within(HOPELESS));
            }
        }
        by_vertices(self.original, &correspondences, &NUISANCES, whole)?;
        self.corresponding = correspondences.into_iter().filter(Correspondence::fits).take(FEW).collect();
        if all_placed {
            return Ok(true);
        }
        let numbered = self.suspect.correspondence.is_none();
        if numbered && whole.is_shared() && !whole.is_found() {
            return self.look_at_vertices_in_mirror();
        }
        Ok(false)
    }

    /// All that are stored or that the connectivity permits.
    fn correspondences(&mut self, whole: &mut Tally<'a, E>) -> Vec<Correspondence> {
        let (original, registers) = (self.original, whole.registers());
        if let Some(stored) = &self.suspect.correspondence {
            return vec![Correspondence::new(original, stored.clone(), registers)];
        }
        let known = self.glance.matched.take();
        let found = known.unwrap_or_else(|| {
            whole.seconds.time("matching", || matched(original.model(), &self.suspect.soup))
        });
        // A turned body goes onto itself in so many ways that the right one may not be among those that were looked at.
        let wrong = found.truncated;
        let all = found.ways.into_iter().map(|found| Correspondence::new(original, found, registers));
        let all = all.map(|found| if wrong { found.doubted() } else { found });
        if original.has_parts()
            && are_alike(&components(original.model().soup()), &components(&self.suspect.soup))
        {
            return all.map(Correspondence::doubted_if_partial).collect();
        }
        all.collect()
    }

    /// Looks at numberings of the faces turned round, which a connectivity that is its own mirror image hides, where they fit.
    fn look_at_vertices_in_mirror(&mut self) -> Result<bool, E::Error> {
        if self.is_spent() {
            return Ok(false);
        }
        let mut tally = self.tally(Look::Mirrored);
        let triangles = self.suspect.soup.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let turned = Soup::new(self.suspect.soup.points.clone(), triangles);
        let found = tally.seconds.time("matching", || matched(self.original.model(), &turned));
        let all = found.ways.into_iter().map(|found| Correspondence::new(self.original, found, true));
        let mirrored: Vec<_> = all.filter(|found| found.fits() && found.is_mirrored()).collect();
        by_vertices(self.original, &mirrored, &NUISANCES, &mut tally)?;
        Ok(self.close(tally, Vec::new()))
    }

    fn by_surfaces(&mut self, whole: &mut Tally<'a, E>) -> Result<(), E::Error> {
        let (original, suspect) = (self.original, &self.suspect.soup);
        let outline = original.outline();
        let upright = match self.glance.similar.take() {
            Some(known) => known,
            None => similar(outline, suspect, self.options.registration, &mut whole.seconds)?,
        };
        let (trusted, limit) = (upright.is_trusted(), upright.limit_of_mirror_image());
        // What is found needs no other look, so that each kind of look is at one thing, which the shape decides.
        let others = whole.is_shared() && !whole.is_found();
        if others && !trusted && (self.look_in_mirror(limit)? || self.look_at_surfaces_of_parts()?) {
            return Ok(());
        }
        let affine = match self.glance.stretched.take() {
            _ if !upright.is_doubted() || self.budget.is_spent() => None,
            Some(known) => known,
            None => stretched(outline, suspect, &mut whole.seconds),
        };
        let poses = poses(outline, suspect, self.options.registration, upright, affine)?;
        whole.warnings.extend(poses.warning);
        // All that were planned count.
        let nuisances = if poses.unrelated { &NUISANCES[..QUICK] } else { &NUISANCES[..] };
        if poses.found.len() == MOST_POSES && outline.reference().is_ok_and(|r| r.is_endless()) {
            whole.warnings.push(ENDLESS.to_owned());
            by_surfaces(original, self.suspect, &poses.found[..SOME], &NUISANCES[..1], whole)?;
            return Ok(());
        }
        by_surfaces(original, self.suspect, &poses.found, nuisances, whole)?;
        if !poses.unrelated {
            self.poses = poses.found.into_iter().take(FEW).collect();
        }
        if whole.is_shared() && trusted && !whole.is_found() {
            self.look_in_mirror(limit)?;
        }
        Ok(())
    }

    /// Looks at the mirror image where its fit is not worse than `limit`. Whether the mark is certain.
    fn look_in_mirror(&mut self, limit: f64) -> Result<bool, E::Error> {
        if self.is_spent() || self.has_looked(Look::Mirrored) {
            return Ok(false);
        }
        let mut tally = self.tally(Look::Mirrored);
        let suspect = &self.suspect.soup;
        let poses = match self.glance.mirrored.take() {
            Some(known) => known,
            None => mirrored(self.original.outline(), suspect, limit, &mut tally.seconds),
        };
        by_surfaces(self.original, self.suspect, &poses, &NUISANCES, &mut tally)?;
        Ok(self.close(tally, Vec::new()))
    }

    fn has_looked(&self, look: Look) -> bool {
        self.done.looks.iter().any(|done| done.look == look)
    }

    /// Looks at components whose surfaces fit parts, unless their vertices did.
    fn look_at_surfaces_of_parts(&mut self) -> Result<bool, E::Error> {
        if self.is_spent() || self.options.resampling == When::Never || self.has_looked(Look::Parts) {
            return Ok(false);
        }
        let components = self.components();
        let shapes = self.shapes_of_parts(&components);
        let seconds = &mut self.done.seconds;
        let found = seconds.time("registration", || placements::by_surfaces(&shapes, &components));
        if found.is_empty() { Ok(false) } else { self.look_at_parts(found) }
    }

    fn look_at_parts(&mut self, found: Vec<Found<'_>>) -> Result<bool, E::Error> {
        let mut tally = self.tally(Look::Parts);
        let parts = by_parts(self.original, found, &mut tally)?;
        Ok(self.close(tally, parts))
    }

    /// The components of the suspect, where it or the original has several.
    fn components(&self) -> Vec<Component> {
        if self.suspect.cloud {
            return Vec::new();
        }
        let components = components(&self.suspect.soup);
        if components.len() > 1 || self.original.has_parts() { components } else { Vec::new() }
    }

    /// Those of the original's parts, where there are components to be laid on them.
    fn shapes_of_parts(&self, components: &[Component]) -> Vec<&'a PartShape> {
        let parts = if components.is_empty() { &[] } else { self.original.parts() };
        parts.iter().map(|part| &part.shape).collect()
    }

    fn tally(&self, look: Look) -> Tally<'a, E> {
        Tally::new(self.options, self.budget, look, self.examiner.clone())
    }

    /// Ends a look. Whether it is certain.
    fn close(&mut self, mut tally: Tally<'a, E>, parts: Vec<FoundPart>) -> bool {
        tally.finish();
        let (certain, counted, look) = (tally.is_certain(), tally.counted(), tally.look());
        if tally.is_found() || !self.found {
            // How badly the whole fits matters to nobody whose parts were found.
            self.done.warnings.append(&mut tally.warnings);
        }
        self.found |= tally.is_found();
        self.clear |= tally.is_clear();
        self.done.budget_spent |= !certain && self.budget.is_spent();
        self.done.seconds.add(tally.seconds);
        if tally.examiner.best().is_some() {
            self.done.looks.push(Looked { look, examiner: tally.examiner, counted, parts });
        }
        certain
    }
}
