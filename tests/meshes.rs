//! Groups of meshes: one of each kind that a mark has to live on.

use nalgebra::{Point3, Vector3};
use sombrero::mesh::{Edges, Soup};
use sombrero::shapes;

/// A mesh of every kind, with 1000 to 3000 vertices each.
pub fn groups() -> Vec<(&'static str, Soup)> {
    vec![
        ("closed, free form", shapes::bumpy_sphere(2000)),
        ("closed, a bust", shapes::bust(14)),
        ("closed, sharp creases and holes", shapes::part(6)),
        ("open", shapes::open_sheet(48, 36)),
        ("open, with a hole", shapes::sheet_with_hole(54, 42)),
        ("genus 2", wavy(&shapes::genus(2, 5))),
        ("several components", components()),
        ("non-manifold", pinched_with_a_fin()),
    ]
}

/// A bumpy torus of 60 x 30 quads; each two triangles in a row are a quad, split as a fan.
pub fn ring() -> Soup {
    wavy(&shapes::torus(60, 30, 2.0, 0.7))
}

/// A square of `n` x `n` cells in the plane z = 0: no relief at all.
pub fn flat_sheet(n: usize) -> Soup {
    mapped(&shapes::open_sheet(n, n), |p| Point3::new(p.x, p.y, 0.0))
}

/// The soup with every vertex moved by `place`.
pub fn mapped(soup: &Soup, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(place).collect(), soup.triangles.clone())
}

/// The soup with relief of a few per cent, so that flat sides can carry a mark.
pub fn wavy(soup: &Soup) -> Soup {
    mapped(soup, |p| {
        let long =
            Vector3::new((2.1 * p.y + p.z).sin(), (1.7 * p.z - p.x).sin(), (1.9 * p.x + 0.6 * p.y).cos());
        let short = Vector3::new((5.3 * p.z + 1.0).sin(), (4.9 * p.x + p.y).cos(), (6.1 * p.y - p.x).sin());
        p + 0.09 * long + 0.04 * short
    })
}

/// Both soups in one, nothing shared.
pub fn joined(first: &Soup, second: &Soup) -> Soup {
    let shift = u32::try_from(first.points.len()).unwrap();
    let mut soup = first.clone();
    soup.points.extend(&second.points);
    soup.triangles.extend(second.triangles.iter().map(|corners| corners.map(|v| v + shift)));
    soup
}

/// A wavy tile whose left and right edges fit.
pub fn tile() -> Soup {
    let mut tile = shapes::open_sheet(24, 24);
    let bounds = tile.bounding_box().unwrap();
    for p in &mut tile.points {
        let [x, y] = [p.x - bounds.min.x, p.y - bounds.min.y].map(|x| x / bounds.sides().x);
        let turn = std::f64::consts::TAU;
        *p = Point3::new(
            x,
            y,
            0.1 * (turn * x).sin() * (2.0 * turn * y).cos() + 0.05 * (3.0 * turn * (x + y)).cos(),
        );
    }
    tile
}

/// A surface about another, `gap` away along its normals.
pub fn shell(body: &Soup, gap: f64) -> Soup {
    let points = body.points.iter().zip(body.vertex_normals()).map(|(p, n)| p + n * gap).collect();
    Soup::new(points, body.triangles.clone())
}

/// A plate with waves on both sides.
pub fn wall(thickness: f64) -> Soup {
    let front = tile();
    let count = front.points.len() as u32;
    let mut wall = front.clone();
    wall.points.iter_mut().for_each(|p| p.z += thickness);
    wall.points.extend(&front.points);
    wall.triangles.extend(front.triangles.iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    let edges = Edges::new(front.points.len(), &front.triangles);
    for (face, corners) in front.triangles.iter().enumerate() {
        for k in (0..3).filter(|k| edges.sides[edges.of_side[3 * face + k] as usize] == 1) {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            wall.triangles.extend([[b, a, a + count], [b, a + count, b + count]]);
        }
    }
    wall
}

fn components() -> Soup {
    let beside = |soup: &Soup, x: f64| mapped(soup, |p| p + Vector3::new(x, 0.0, 0.0));
    let two = joined(&shapes::bumpy_sphere(1000), &beside(&wavy(&shapes::torus(40, 20, 1.0, 0.4)), 3.0));
    joined(&two, &beside(&shapes::tetrahedron(), -3.0))
}

/// A bumpy ball and its image in a point of its surface, which both share, and one edge with three faces.
fn pinched_with_a_fin() -> Soup {
    let ball = shapes::bumpy_sphere(1000);
    let touch = ball.points[0];
    let mut image = mapped(&ball, |p| touch + (touch - p));
    // A point reflection turns the faces inside out.
    image.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
    let first_of_image = u32::try_from(ball.points.len()).unwrap();
    let mut soup = joined(&ball, &image);
    for corner in soup.triangles.iter_mut().flatten().filter(|corner| **corner == first_of_image) {
        *corner = 0;
    }
    let [a, b, _] = soup.triangles[700];
    let middle = nalgebra::center(&soup.points[a as usize], &soup.points[b as usize]);
    let tip = u32::try_from(soup.points.len()).unwrap();
    soup.points.push(Point3::from(middle.coords * 1.2));
    soup.triangles.push([b, a, tip]);
    soup
}
