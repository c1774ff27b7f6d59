//! Models whose poses are sought, and shapes that are none of them.

use anyhow::Context;
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::shapes;
use std::path::Path;

pub(super) type Make<'a> = (&'static str, bool, Box<dyn Fn() -> anyhow::Result<Soup> + 'a>);

/// Name, whether it is symmetric, and how to get it.
pub(super) fn subjects(folder: &Path) -> Vec<Make<'_>> {
    let read = |name: &'static str, file: &'static str| -> Make<'_> {
        let path = folder.join(file);
        let make = move || {
            let document =
                Document::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
            Ok(sombrero::Model::new(document.soup()).soup().clone())
        };
        (name, false, Box::new(make))
    };
    let generated =
        |name, symmetric, soup: fn() -> Soup| -> Make<'_> { (name, symmetric, Box::new(move || Ok(soup()))) };
    vec![
        read("fandisk", "fandisk.obj"),
        read("head", "head.obj"),
        read("dragon", "dragon.obj"),
        read("bunny", "bunny.ply"),
        generated("part", false, || shapes::part(4)),
        generated("bust", false, || shapes::bust(20)),
        generated("genus 3", true, || shapes::genus(3, 4)),
        generated("pretzel", true, || shapes::genus(1, 6)),
        generated("torus", true, || shapes::torus(60, 30, 2.0, 0.7)),
        generated("cube", true, || subdivided(shapes::cube(), 4)),
        generated("octahedron", true, || subdivided(shapes::octahedron(), 4)),
        generated("tetrahedron", true, || subdivided(shapes::tetrahedron(), 5)),
    ]
}

/// Shapes that are none of the models; a generated one is not compared with itself.
pub(super) fn others() -> Vec<(&'static str, Soup)> {
    vec![
        ("bumpy sphere", shapes::bumpy_sphere(8_000)),
        ("torus", shapes::torus(120, 60, 2.0, 0.7)),
        ("icosahedron", subdivided(shapes::icosahedron(), 3)),
        ("cube", subdivided(shapes::cube(), 4)),
        ("bust", shapes::bust(30)),
        ("part", shapes::part(5)),
    ]
}

/// Each triangle cut into four, `times` times.
pub(super) fn subdivided(mut soup: Soup, times: usize) -> Soup {
    for _ in 0..times {
        let mut middles = std::collections::BTreeMap::new();
        let mut triangles = Vec::with_capacity(4 * soup.triangles.len());
        for &[a, b, c] in &soup.triangles {
            let mut middle = |u: u32, v: u32| {
                *middles.entry((u.min(v), u.max(v))).or_insert_with(|| {
                    soup.points.push(nalgebra::center(&soup.points[u as usize], &soup.points[v as usize]));
                    soup.points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        soup.triangles = triangles;
    }
    soup
}
