//! The umbrella operator.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::Umbrella;
use sombrero_shapes as shapes;

#[test]
fn a_whole_step_is_the_mean_of_the_neighbours() {
    let mut soup = shapes::tetrahedron();
    soup.points.push(Point3::new(7.0, 7.0, 7.0));
    soup.triangles.push([0, 1, 99]);
    let once = Umbrella::new(&soup).step(&soup.points, 1.0);
    let sum: Vector3<f64> = soup.points[..4].iter().map(|p| p.coords).sum();
    for (moved, p) in once.iter().zip(&soup.points[..4]) {
        assert!((moved.coords - (sum - p.coords) / 3.0).norm() < 1e-15);
    }
    assert_eq!(once[4], soup.points[4], "a vertex without a usable face");
}
