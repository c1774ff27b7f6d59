//! The fidelity of a change, for people.

use crate::lengths::length;
use crate::table::Table;
use sombrero::fidelity::Fidelity;

/// What is seen of a change, and what it does to parts that must fit, as far as there are any.
pub(crate) fn rows(fidelity: &Fidelity, unit: Option<&str>) -> Table {
    let Fidelity { mrms, normals_rms, normals_p99, msdm2, flat_dihedral, flatness, .. } = fidelity;
    let surface = format!("MRMS {:.4} % of the diagonal, MSDM2 {msdm2:.3}", mrms * 100.0);
    let normals = format!("turned by {normals_rms:.2} degrees rms, {normals_p99:.2} at the 99th percentile");
    let edges = flat_dihedral.map(|bend| format!("edges by {bend:.3} degrees rms"));
    let planes = flatness.map(|bend| format!("regions by {:.4} % of the largest side", bend * 100.0));
    let flat: Vec<String> = edges.into_iter().chain(planes).collect();
    let walls = fidelity.thinnest_before.zip(fidelity.thinnest_after);
    Table::default()
        .row("surface", surface)
        .row("normals", normals)
        .rows("flat", (!flat.is_empty()).then(|| format!("bent {}", flat.join(", "))))
        .rows(
            "walls, gaps",
            walls.map(|(before, after)| {
                format!("thinnest {}, now {}", length(before, unit), length(after, unit))
            }),
        )
}
