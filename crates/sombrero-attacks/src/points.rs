//! A point cloud: places on the surface, evenly likely, and no faces. Such a file has the shape of a mesh but nothing of its
//! connectivity.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::Soup;
use sombrero_spatial::sample_surface;

/// Points taken at most.
const MOST: f64 = 1e7;

/// So many points of the surface.
///
/// # Errors
/// [`AttackError::Parameter`] unless there are 1 to 10⁷, [`AttackError::NothingLeft`] of a mesh without area.
pub fn point_cloud<R: Rng + ?Sized>(
    soup: &Soup,
    count: u32,
    rng: &mut R,
) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("count", f64::from(count), (1.0, MOST), "between 1 and 10000000")?;
    let Soup { points, triangles } = soup;
    let samples = sample_surface(points, triangles, count as usize, rng);
    let places: Vec<Point3<f64>> =
        samples.iter().filter_map(|sample| sample.point(points, triangles)).collect();
    if places.is_empty() { Err(AttackError::NothingLeft) } else { Ok(places) }
}

/// The attack that keeps points alone. No other can follow it: they need faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointCloud {
    /// How many points, 1 to 10⁷.
    pub count: u32,
}

impl Operation for PointCloud {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let count = given.whole("count")?;
        Ok(Self { count: given.needed("count", count)? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("count", self.count.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::anew(Soup::new(point_cloud(soup, self.count, rng)?, Vec::new())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    #[test]
    fn points_lie_on_the_surface() {
        let soup = shapes::sphere(5);
        let cloud = point_cloud(&soup, 3000, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        assert_eq!(cloud.len(), 3000);
        assert!(cloud.iter().all(|p| (p.coords.norm() - 1.0).abs() < 2e-3));
        // On either side about as many.
        let above = cloud.iter().filter(|p| p.z > 0.0).count();
        assert!(above.abs_diff(1500) < 150, "{above}");
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        assert!(matches!(point_cloud(&soup, 0, &mut rng), Err(AttackError::Parameter { .. })));
        let none = Soup::new(soup.points, vec![[1, 1, 1]]);
        assert_eq!(point_cloud(&none, 10, &mut rng), Err(AttackError::NothingLeft));
    }
}
