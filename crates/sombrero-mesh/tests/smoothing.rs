//! What smoothing filters do to a surface.

use nalgebra::Vector3;
use sombrero_mesh::smoothing_modes;
use sombrero_shapes as shapes;

#[test]
fn stronger_smoothing_moves_further_and_inwards() {
    let soup = shapes::sphere(3);
    let modes = smoothing_modes(&soup);
    let inward = |mode: &[Vector3<f64>]| -> f64 {
        -mode.iter().zip(&soup.points).map(|(d, p)| d.dot(&p.coords.normalize())).sum::<f64>()
    };
    let depths: Vec<f64> = modes[1..].iter().map(|m| inward(m)).collect();
    assert!(depths[0] > 0.0 && depths.is_sorted(), "{depths:?}");
    assert!(inward(&modes[0]).abs() < depths[1], "Taubin's filter hardly shrinks");
}
