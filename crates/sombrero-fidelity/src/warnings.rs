//! What the owner of a model should know of a change, in sentences.

use crate::{Fidelity, digits};

/// Normals that turn by more than this show on flat faces, in degrees rms: on a machined part nothing was seen side by side
/// at 0.29, and dents at once at 1.18.
pub const TURNED: f64 = 0.35;
/// A planar region may be bent by this share of the largest side: ISO 2768-2, class H, allows 0.1 mm on 100 mm.
pub const BENT: f64 = 1e-3;
/// MSDM2 above this is seen: the limit that Wang et al. (2010) set for robustness benchmarks.
pub const DIFFERENT: f64 = 0.2;
/// A wall or gap should keep this share of its thickness.
pub const THINNED: f64 = 0.9;
/// A crack may open by this share of the diagonal.
pub const OPENED: f64 = 1e-5;

impl Fidelity {
    /// What is amiss, each with its figures and what to do about it. Empty when nothing is: see [`TURNED`], [`BENT`],
    /// [`DIFFERENT`], [`THINNED`] and [`OPENED`]. `milder` is what there is besides a lower epsilon by which less would be seen,
    /// such as `take --preset faithful`.
    pub fn warnings(&self, milder: Option<&str>) -> Vec<String> {
        let cure = ["lower epsilon"].into_iter().chain(milder).collect::<Vec<_>>().join(" or ");
        let all = [self.seen(&cure), self.bent(&cure), self.thinned(), self.crossing(), self.opened()];
        all.into_iter().flatten().collect()
    }

    /// Flat faces show a turn of their normals; on others only the whole picture tells.
    fn seen(&self, cure: &str) -> Option<String> {
        let Self { normals_rms, msdm2, flatness, .. } = self;
        if flatness.is_some() && *normals_rms > TURNED {
            return Some(format!(
                "Normals turn by {normals_rms:.2} degrees rms, which shows on flat faces under a glossy light; {cure}."
            ));
        }
        (*msdm2 > DIFFERENT).then(|| {
            format!(
                "The change is seen side by side: MSDM2 is {msdm2:.2}, and {DIFFERENT:.2} is much; {cure}."
            )
        })
    }

    fn bent(&self, cure: &str) -> Option<String> {
        let bent = self.flatness.filter(|bent| *bent > BENT)?;
        Some(format!(
            "A flat face is bent by {:.2} % of the largest side, more than the {:.1} % that ISO 2768-2, class H, allows; \
             {cure} if parts must fit.",
            bent * 100.0,
            BENT * 100.0
        ))
    }

    fn thinned(&self) -> Option<String> {
        let (before, after) = self.thinnest_before.zip(self.thinnest_after)?;
        (after < THINNED * before).then(|| {
            format!(
                "A wall or gap of {} becomes {} thin; lower epsilon, or allow a smaller displacement.",
                digits(before, 3),
                digits(after, 3)
            )
        })
    }

    fn crossing(&self) -> Option<String> {
        let pairs = self.new_intersections;
        let (which, verb) =
            if pairs == 1 { ("pair of faces", "crosses") } else { ("pairs of faces", "cross") };
        (pairs > 0).then(|| {
            format!(
                "{pairs} {which} {verb} that did not before; lower epsilon, or allow a smaller displacement."
            )
        })
    }

    fn opened(&self) -> Option<String> {
        let (before, after) = (self.widest_crack_before, self.widest_crack_after);
        (after - before > OPENED * self.diagonal).then(|| {
            format!(
                "Points that met come apart by {} (before: {}); join the parts, or mark them as one mesh.",
                digits(after, 3),
                digits(before, 3)
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    const NOTHING: Fidelity = Fidelity {
        mrms: 0.0,
        normals_rms: 0.0,
        normals_p99: 0.0,
        msdm2: 0.0,
        flat_dihedral: None,
        flatness: None,
        new_intersections: 0,
        thinnest_before: None,
        thinnest_after: None,
        widest_crack_before: 0.0,
        widest_crack_after: 0.0,
        diagonal: 100.0,
    };

    #[test]
    fn figures_and_cure() {
        assert_eq!(NOTHING.warnings(None), Vec::<String>::new());
        let all = Fidelity {
            normals_rms: 1.18,
            msdm2: 0.265,
            flatness: Some(0.0072),
            new_intersections: 3,
            thinnest_before: Some(0.8),
            thinnest_after: Some(0.06),
            widest_crack_before: 1e-7,
            widest_crack_after: 0.0124,
            ..NOTHING
        };
        let said = all.warnings(Some("take a finer mesh"));
        assert!(said[0].ends_with("; lower epsilon or take a finer mesh."), "{said:#?}");
        assert!(all.warnings(None)[1].ends_with("; lower epsilon if parts must fit."), "{said:#?}");
        assert_eq!(said.len(), 5, "{said:#?}");
        let figures = ["1.18 degrees", "0.72 %", "0.8 becomes 0.06", "3 pairs of faces cross", "0.0124"];
        assert!(figures.iter().zip(&said).all(|(figure, said)| said.contains(figure)), "{said:#?}");
    }

    #[test]
    fn only_beyond_the_limits() {
        let within = Fidelity {
            normals_rms: 0.3,
            msdm2: 0.19,
            flatness: Some(9e-4),
            thinnest_before: Some(1.0),
            thinnest_after: Some(0.91),
            widest_crack_after: 9e-4,
            ..NOTHING
        };
        assert_eq!(within.warnings(None), Vec::<String>::new());
        // Curved models bear what flat ones do not.
        let curved = Fidelity { normals_rms: 1.0, flatness: None, ..within };
        assert_eq!(curved.warnings(None), Vec::<String>::new());
        assert!(Fidelity { msdm2: 0.3, ..curved }.warnings(None)[0].contains("0.30"));
        let one = Fidelity { new_intersections: 1, ..NOTHING };
        assert!(one.warnings(None)[0].starts_with("1 pair of faces crosses"));
    }

    #[test]
    fn a_mesh_of_nothing_is_as_it_was() {
        let lost = [Point3::new(f64::NAN, 0.0, 0.0); 3];
        assert_eq!(
            Fidelity::between(&lost, &lost, &[[0, 1, 2], [7, 8, 9]], None),
            Fidelity { diagonal: 0.0, ..NOTHING }
        );
    }
}
