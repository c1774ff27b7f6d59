//! Assemblies small enough to say by hand how they must move.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::{Assembly, Coupling, Shown, facing, join, reach};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use proptest::prelude::*;
use sombrero_mesh::Soup;
use sombrero_shapes as shapes;

fn coupling(soup: &Soup, places: &[Shown]) -> Coupling {
    let reach = reach(&soup.points, &soup.triangles, &[]);
    Coupling::new(&Assembly {
        points: &soup.points,
        triangles: &soup.triangles,
        reach: &reach,
        places,
        draws_loose: true,
    })
}

fn shown(soup: &Soup, linear: Matrix3<f64>, shift: Vector3<f64>) -> Shown {
    Shown { points: (0..soup.points.len() as u32).collect(), linear, shift }
}

fn square() -> Soup {
    let points = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(Point3::from);
    Soup::new(points.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// Several meshes in one.
fn together(soups: &[Soup]) -> Soup {
    let mut all = Soup::default();
    for soup in soups {
        let first = all.points.len() as u32;
        all.points.extend(&soup.points);
        all.triangles.extend(soup.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

fn moved_up(soup: &Soup, shift: Vector3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| p + shift).collect(), soup.triangles.clone())
}

#[test]
fn a_mesh_of_one_part_is_free() {
    for soup in [
        shapes::sphere(3),
        shapes::open_sheet(9, 7),
        shapes::torus(12, 8, 1.0, 0.4),
        shapes::part(8),
        square(),
    ] {
        assert!(coupling(&soup, &[]).is_free());
        assert_eq!(join(&soup.points, &soup.triangles, &reach(&soup.points, &soup.triangles, &[])), None);
    }
}

#[test]
fn a_mirror_leaves_its_plane_and_a_turn_its_axis() {
    let soup = square();
    let field = vec![Vector3::new(1.0, 2.0, 3.0); 4];
    let mirror = shown(&soup, Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0)), Vector3::zeros());
    let moved = coupling(&soup, &[mirror]).apply(&field);
    for v in [0, 3] {
        assert!((moved[v] - Vector3::new(0.0, 2.0, 3.0)).norm() < 1e-12);
    }
    assert_eq!(moved[1], field[1]);
    // A half turn about the edge at x = 0.
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI).into_inner();
    let moved = coupling(&soup, &[shown(&soup, turn, Vector3::zeros())]).apply(&field);
    for v in [0, 3] {
        assert!((moved[v] - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
    }
}

#[test]
fn a_point_that_meets_itself_turned_in_two_ways_stands_still() {
    let soup = square();
    let turn = |axis| Rotation3::from_axis_angle(&axis, 1.0).into_inner();
    let places =
        [Vector3::x_axis(), Vector3::z_axis()].map(|axis| shown(&soup, turn(axis), Vector3::zeros()));
    let moved = coupling(&soup, &places).apply(&[Vector3::new(1.0, 2.0, 3.0); 4]);
    assert_eq!(moved[0], Vector3::zeros());
    assert_eq!(moved[2], Vector3::new(1.0, 2.0, 3.0));
}

#[test]
fn what_lies_close_above_moves_with_it() {
    let body = shapes::open_sheet(10, 10);
    let side = body.bounding_box().unwrap().largest_side();
    let patch = |height: f64| {
        let small = square();
        let at = body.points[60];
        Soup::new(
            small.points.iter().map(|p| at + p.coords * 0.1 * side + Vector3::z() * height * side).collect(),
            small.triangles,
        )
    };
    for (height, own) in [(0.002, 0.0), (0.03, 1.0)] {
        let flat = Soup::new(
            body.points.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect(),
            body.triangles.clone(),
        );
        let mut above = patch(height);
        above.points.iter_mut().for_each(|p| p.z = height * side);
        let all = together(&[flat, above]);
        let mut field = vec![Vector3::z(); body.points.len()];
        field.resize(all.points.len(), Vector3::x());
        let moved = coupling(&all, &[]).apply(&field);
        for d in &moved[body.points.len()..] {
            assert!((d - (Vector3::x() * own + Vector3::z() * (1.0 - own))).norm() < 1e-12, "{height}: {d}");
        }
    }
}

/// The two ends of a needle, and two places of one surface that touch: whatever connects them, they stay together.
#[test]
fn points_of_one_part_that_meet_move_together() {
    let ball = shapes::sphere(3);
    let [a, b, _] = ball.triangles[0];
    let far = (0..ball.points.len() as u32)
        .find(|v| ball.triangles.iter().all(|t| !(t.contains(v) && t.contains(&a))));
    for other in [b, far.unwrap()] {
        let mut soup = ball.clone();
        soup.points[other as usize] = soup.points[a as usize] + Vector3::new(0.0, 0.0, 1e-7);
        let coupling = coupling(&soup, &[]);
        let shifts: Vec<_> = (0..soup.points.len()).map(|v| Vector3::new(v as f64, 1.0, -2.0)).collect();
        let moved = coupling.apply(&shifts);
        assert_eq!(moved[a as usize], moved[other as usize]);
        assert_eq!(moved[a as usize], (shifts[a as usize] + shifts[other as usize]) / 2.0);
        assert_eq!(coupling.rows().count(), 2);
    }
}

/// A ball and a ball of half its size beside it, this many largest sides apart; less than nothing where they cut.
fn beside(gap: f64) -> Soup {
    let ball = shapes::sphere(3);
    let side = ball.bounding_box().unwrap().largest_side();
    let half = |p: &Point3<f64>| Point3::from(p.coords / 2.0 + Vector3::x() * side * (0.75 + gap));
    let smaller = Soup::new(ball.points.iter().map(half).collect(), ball.triangles.clone());
    together(&[ball, smaller])
}

#[test]
fn a_solid_that_stands_beside_a_larger_one_is_free_until_it_touches() {
    assert!(coupling(&beside(0.004), &[]).is_free());
    for gap in [0.0005, -0.005, -0.1] {
        assert!(!coupling(&beside(gap), &[]).is_free(), "{gap}");
    }
}

/// A rod through a plate: no vertex of the one is near the other, but its edges cut it.
#[test]
fn a_solid_that_cuts_a_larger_one_goes_along_where_it_comes_near() {
    let block = |x: f64, y: f64, z: f64, up: f64| {
        let mut cube = shapes::cube();
        let half = cube.bounding_box().unwrap().largest_side() / 2.0;
        let centre = cube.points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 8.0;
        cube.points.iter_mut().for_each(|p| {
            let v = (p.coords - centre) / half;
            *p = Point3::new(v.x * x, v.y * y, v.z * z + up);
        });
        cube
    };
    let plate = block(1.0, 1.0, 0.005, 0.0);
    // Its lower end is a fiftieth below the plate, and its upper far above.
    let rod = |up: f64| together(&[plate.clone(), block(0.05, 0.05, 0.5, up)]);
    assert!(!coupling(&rod(0.48), &[]).is_free());
    assert!(coupling(&rod(0.51), &[]).is_free());
}

#[test]
fn a_closed_layer_moves_with_what_it_lies_on() {
    let ball = shapes::sphere(3);
    let shell = Soup::new(ball.points.iter().map(|p| p * 1.01).collect(), ball.triangles.clone());
    let both = together(&[shell, ball]);
    let count = both.points.len() / 2;
    let coupling = coupling(&both, &[]);
    assert_eq!(coupling.rows().count(), count);
}

#[test]
fn points_that_no_triangle_has_follow_the_surface_below() {
    let mut soup = square();
    soup.points.push(Point3::new(0.5, 0.25, 1e-3));
    soup.points.push(Point3::new(0.5, 0.25, 1.0));
    let field: Vec<Vector3<f64>> = (0..6).map(|i| Vector3::new(f64::from(i), 0.0, 0.0)).collect();
    let moved = coupling(&soup, &[]).apply(&field);
    // In the first triangle, with weights 1/2, 1/4 and 1/4.
    assert!((moved[4].x - (0.5 * 0.0 + 0.25 * 1.0 + 0.25 * 2.0)).abs() < 1e-9);
    assert_eq!(moved[5], field[5]);
}

#[test]
fn chains_of_rounding_do_not_run_together() {
    // Points along a line, each within reach of the next.
    let step = 0.9e-6;
    let mut soup = shapes::sphere(2);
    let size = soup.bounding_box().unwrap().largest_side();
    let first = soup.points.len();
    soup.points.extend((0..50).map(|i| Point3::new(9.0 + f64::from(i) * step * size * 0.9, 0.0, 0.0)));
    let reach = reach(&soup.points, &soup.triangles, &[]);
    let leaders = join(&soup.points, &soup.triangles, &reach).unwrap();
    for (v, &leader) in leaders.iter().enumerate().skip(first) {
        assert!((soup.points[v] - soup.points[leader as usize]).norm() <= 2.0 * reach[v]);
    }
}

#[test]
fn a_coarse_grid_joins_its_neighbours_but_no_triangle_s_corners() {
    let left = square();
    let mut right = moved_up(&square(), Vector3::x());
    right.points.iter_mut().for_each(|p| p.x += 1e-3);
    let both = together(&[left, right]);
    let steps = |step: f32| vec![step; both.points.len()];
    let joined =
        |step| join(&both.points, &both.triangles, &reach(&both.points, &both.triangles, &steps(step)));
    assert_eq!(joined(1e-3), Some(vec![0, 1, 2, 3, 1, 5, 6, 2]));
    assert_eq!(joined(1e-4), None);
    // Whole numbers: neighbours on the grid are neighbours of the mesh.
    assert_eq!(joined(1.0), Some(vec![0, 1, 2, 3, 1, 5, 6, 2]));
    assert_eq!(
        join(&square().points, &square().triangles, &reach(&square().points, &square().triangles, &[1.0; 4])),
        None
    );
}

#[test]
fn two_sides_of_a_plate_face_each_other() {
    let lower = Soup::new(square().points, square().triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect());
    let plate = together(&[lower, moved_up(&square(), Vector3::z() * 0.1)]);
    let reach = reach(&plate.points, &plate.triangles, &[]);
    let assembly = Assembly {
        points: &plate.points,
        triangles: &plate.triangles,
        reach: &reach,
        places: &[],
        draws_loose: false,
    };
    let pairs = facing(&assembly, &[0.5; 8], |_| true);
    assert!(pairs.len() >= 8, "{}", pairs.len());
    for pair in &pairs {
        assert!((pair.distance - 0.1).abs() < 1e-12);
        let apart = |up: f64, down: f64| -> f64 {
            let d = |v: u32| Vector3::z() * if v < 4 { down } else { up };
            pair.terms.iter().map(|(v, map)| map * d(*v)).sum::<Vector3<f64>>().dot(&pair.direction)
        };
        assert!(apart(1.0, 1.0).abs() < 1e-12);
        assert!((apart(1.0, 0.0).abs() - 1.0).abs() < 1e-12);
    }
    assert!(facing(&assembly, &[0.05; 8], |_| true).is_empty());
    assert!(facing(&assembly, &[0.5; 8], |pair| pair.distance > 0.2).is_empty());
}

proptest! {
    #[test]
    fn what_meets_anywhere_moves_alike(
        turns in prop::collection::vec(([-2.0..2.0_f64, -2.0..2.0, -2.0..2.0], any::<bool>()), 1..4),
        field in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 25)
    ) {
        let soup = shapes::open_sheet(4, 4);
        let field: Vec<Vector3<f64>> = field.into_iter().map(Vector3::from).collect();
        // Every place turns about a vertex or lays one on another.
        let place = |(i, (turn, flip)): (usize, &([f64; 3], bool))| {
            let mut linear = Rotation3::from_scaled_axis(Vector3::from(*turn)).into_inner();
            if *flip {
                linear *= Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
            }
            let (from, to) = (soup.points[3 * i], soup.points[5 * i]);
            shown(&soup, linear, to.coords - linear * from.coords)
        };
        let places: Vec<Shown> = turns.iter().enumerate().map(place).collect();
        let moved = coupling(&soup, &places).apply(&field);
        let mut sites: Vec<(Point3<f64>, Vector3<f64>)> = soup.points.iter().copied().zip(moved.iter().copied()).collect();
        for place in &places {
            sites.extend(soup.points.iter().zip(&moved).map(|(p, d)| (place.at(p), place.linear * d)));
        }
        for (i, (p, d)) in sites.iter().enumerate() {
            for (q, e) in &sites[..i] {
                if (p - q).norm() < 1e-7 {
                    prop_assert!((d - e).norm() < 1e-6, "{} {}", d, e);
                }
            }
        }
    }
}
