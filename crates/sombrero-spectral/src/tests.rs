//! What every set of fields has to hold.

use crate::{Columns, Fields, FieldsOptions};
use nalgebra::Point3;
use sombrero_mesh::{Soup, repair};
use sombrero_progressive::ProgressiveMesh;
use sombrero_shapes as shapes;

fn fields(soup: &Soup, options: &FieldsOptions) -> (Fields, Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let made = repair(soup);
    let triangles = made.mesh.triangles();
    let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
    let fields = Fields::new(progressive, &made.points, options).unwrap();
    (fields, made.points, triangles)
}

fn moved(fields: &Fields, points: &[Point3<f64>], epsilon: f64) -> Vec<Point3<f64>> {
    let mut moved = points.to_vec();
    for (i, column) in fields.columns.iter().enumerate() {
        let w = ((i * 7919) % 97) as f64 / 48.0 - 1.0;
        column.for_each(|(v, d)| moved[v as usize] += d * (epsilon * w));
    }
    moved
}

fn few() -> FieldsOptions {
    FieldsOptions { pieces: 8, of_each: 4, share: 0.3, ..FieldsOptions::default() }
}

#[test]
fn planes_stay_planar_on_the_level_and_above_it() {
    let soup = shapes::part(4);
    for vertices in [usize::MAX, soup.points.len() / 3] {
        let (fields, points, triangles) = fields(&soup, &FieldsOptions { vertices, ..few() });
        assert!(fields.planes >= 3, "{}", fields.planes);
        let moved = moved(&fields, &points, 0.01);
        let furthest = points.iter().zip(&moved).map(|(p, q)| (q - p).norm()).fold(0.0, f64::max);
        let bent = Fields::flatness(&points, &moved, &triangles);
        assert!(bent < 1e-9 && furthest > 1e-5, "{bent} of {furthest}");
    }
}

#[test]
fn normals_turn_by_as_much_as_was_asked_for() {
    let (fields, points, triangles) = fields(&shapes::bumpy_sphere(1200), &few());
    let surface = |points: &[Point3<f64>]| crate::surface::Surface::new(points.to_vec(), triangles.clone());
    let before = surface(&points);
    let epsilon = 1e-4;
    let mut sum = 0.0;
    for column in fields.columns.iter() {
        let mut moved = points.clone();
        column.for_each(|(v, d)| moved[v as usize] += d * epsilon);
        let after = surface(&moved);
        let turned =
            after.facets.normals.iter().zip(&before.facets.normals).map(|(a, b)| (a - b).norm_squared());
        sum += turned.zip(&before.facets.areas).map(|(t, a)| t * a).sum::<f64>();
    }
    let turn = (sum / before.area).sqrt();
    assert!((turn / epsilon - 1.0).abs() < 0.01, "{turn}");
}

/// A machined part, whose flats are bent: what is expected is the sum over fields of what each does, and no more than may be
/// seen.
#[test]
fn what_is_seen_of_flat_edges_is_told_and_limited() {
    let (fields, points, triangles) = fields(&shapes::part(4), &few());
    let surface = |points: &[Point3<f64>]| crate::surface::Surface::new(points.to_vec(), triangles.clone());
    let before = surface(&points);
    let angle = |s: &crate::surface::Surface, hinge: &crate::surface::Hinge| {
        let [n, m] = hinge.faces.map(|f| s.facets.normals[f as usize]);
        let [a, b] = hinge.ends.map(|v| s.points[v as usize]);
        libm::atan2(n.cross(&m).dot(&(b - a).normalize()), n.dot(&m))
    };
    let flat = |hinge: &&crate::surface::Hinge| angle(&before, hinge).abs() < 2f64.to_radians();
    let length = |hinge: &crate::surface::Hinge| {
        (before.points[hinge.ends[0] as usize] - before.points[hinge.ends[1] as usize]).norm()
    };
    let epsilon = 1e-5;
    let (mut bent, mut total) = (0.0, 0.0);
    for hinge in before.hinges.iter().filter(flat) {
        total += length(hinge);
    }
    let mut at = vec![Vec::new(); points.len()];
    for (i, column) in (0..).zip(fields.columns.iter()) {
        let mut moved = points.clone();
        for (v, d) in column {
            moved[v as usize] += d * epsilon;
            at[v as usize].push((i, d));
        }
        let after = surface(&moved);
        for hinge in before.hinges.iter().filter(flat) {
            bent += length(hinge) * ((angle(&after, hinge) - angle(&before, hinge)) / epsilon).powi(2);
        }
    }
    let sight = crate::Onlooker::new(&points, &triangles).sight(&at, |_, _| 1.0);
    let expected = sight.flat_edges.unwrap();
    let seen = (bent / total).sqrt();
    assert!((seen / expected - 1.0).abs() < 0.01, "{seen} {expected}");
    assert!(
        sight.room(&FieldsOptions::default()) > 1.0 - 1e-9 && sight.normals_rms < 1.0 + 1e-9,
        "{sight:?}"
    );
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let soup = shapes::bust(14);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fields(&soup, &FieldsOptions { vertices: 500, ..few() }).0.columns)
    };
    let bits = |columns: &Columns| -> Vec<(u32, [u64; 3])> {
        columns.iter().flatten().map(|(v, d)| (v, [d.x, d.y, d.z].map(f64::to_bits))).collect()
    };
    assert_eq!(bits(&run(1)), bits(&run(3)));
}

#[test]
fn few_are_the_strongest_and_asking_for_as_many_as_there_are_changes_nothing() {
    let soup = shapes::bust(14);
    let options = FieldsOptions { vertices: 500, ..few() };
    let all = fields(&soup, &options).0.columns;
    let as_many = fields(&soup, &FieldsOptions { most: all.len(), ..options }).0.columns;
    assert_eq!(all, as_many);
    let half = fields(&soup, &FieldsOptions { most: all.len() / 2, ..options }).0.columns;
    assert_eq!(half.len(), all.len() / 2);
    let again = fields(&soup, &FieldsOptions { most: half.len(), ..options }).0.columns;
    assert_eq!(half, again);
}

/// Flats of few triangles, planes that hold each other, sizes at the limits of numbers.
#[test]
fn any_shape_has_fields_or_none() {
    let part = shapes::part(1);
    let flattened = part.points.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let flat = Soup::new(flattened, part.triangles.clone());
    let small = [shapes::cube(), shapes::tetrahedron(), shapes::open_sheet(5, 4), shapes::bumpy_sphere(60)];
    for soup in small.into_iter().chain([flat, part]) {
        for scale in [1.0, 1e-150, 1e110, 1e300] {
            let points = soup.points.iter().map(|p| p * scale).collect();
            let made = repair(&Soup::new(points, soup.triangles.clone()));
            let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
            if let Ok(fields) = Fields::new(progressive, &made.points, &FieldsOptions::default()) {
                let entries = || fields.columns.iter().flatten();
                assert!(entries().count() > 0, "{scale}");
                assert!(entries().all(|(_, d)| d.iter().all(|x| x.is_finite())), "{scale}");
                assert!(4 * fields.columns.len() <= made.points.len());
            }
        }
    }
}
