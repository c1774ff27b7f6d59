//! The triangles of a picture, and their light at a sample.

use crate::camera::{Camera, Projected};
use crate::colormap::{HeatMap, fraction};
use crate::grid::Grid;
use crate::light::{Light, Rig, from_srgb};
use crate::normals::{corner_normals, unit_or_zero};
use crate::options::RenderOptions;
use crate::raster::{Facet, NONE};
use nalgebra::{Point3, Vector3};

/// The triangles that may be seen, and all it takes to shade them.
pub(crate) struct Scene<'a> {
    camera: &'a Camera,
    options: &'a RenderOptions,
    side: usize,
    view: Vec<Vector3<f64>>,
    pub(crate) facets: Vec<Facet>,
    /// Corners of each facet.
    corners: Vec<[usize; 3]>,
    normals: Vec<[Vector3<f64>; 3]>,
    range: Option<(f64, f64)>,
    rig: Rig,
    colors: Colors,
}

/// The options' colours in linear light.
struct Colors {
    front: Light,
    back: Light,
    line: Light,
}

impl<'a> Scene<'a> {
    pub(crate) fn new(
        points: &[Point3<f64>],
        triangles: &[[u32; 3]],
        camera: &'a Camera,
        grid: &Grid,
        options: &'a RenderOptions,
    ) -> Self {
        let view: Vec<_> = points.iter().map(|p| camera.view(p)).collect();
        let valid = valid_triangles(&view, triangles);
        // Normals come from all valid triangles, so that those outside of the picture still shape their neighbours.
        let all_normals = corner_normals(&view, &valid, options.shading);
        let samples = picture_points(&view, camera, grid);
        let (mut facets, mut corners, mut normals) = (Vec::new(), Vec::new(), Vec::new());
        for (triangle, normal) in valid.into_iter().zip(all_normals) {
            let facet = in_picture(&samples, &triangle)
                .and_then(|corners| Facet::new(&corners, grid.columns(), grid.rows()));
            if let Some(facet) = facet {
                facets.push(facet);
                corners.push(triangle);
                normals.push(normal);
            }
        }
        let color = |c: [u8; 3]| from_srgb(c.map(f64::from));
        let line = options.wireframe.unwrap_or_default().color;
        let colors =
            Colors { front: color(options.color), back: color(options.back_color), line: color(line) };
        let range = options.heat_map.as_ref().and_then(HeatMap::effective_range);
        Self {
            camera,
            options,
            side: grid.side,
            view,
            facets,
            corners,
            normals,
            range,
            rig: Rig::new(),
            colors,
        }
    }

    /// Light at a sample of the given facet.
    pub(crate) fn shade(&self, index: usize, x: f64, y: f64) -> Light {
        let facet = &self.facets[index];
        let lambda = facet.lambda(x, y);
        let at = facet.in_space(&lambda);
        let normal = self.normal(index, &at);
        let surface = match self.heat(index, &at) {
            Some(albedo) => self.rig.shade_softly(&albedo, &normal),
            None => {
                let position = blend(&at, &self.corners[index].map(|v| self.view[v]));
                let albedo = if facet.front { &self.colors.front } else { &self.colors.back };
                self.rig.shade(albedo, &normal, &unit_or_zero(&self.camera.toward_eye(&position)))
            }
        };
        let line = self.line_share(facet, &lambda);
        surface * (1.0 - line) + self.colors.line * line
    }

    /// Unit normal, turned to the side that is seen.
    fn normal(&self, index: usize, at: &[f64; 3]) -> Vector3<f64> {
        let normal = unit_or_zero(&blend(at, &self.normals[index]));
        if self.facets[index].front { normal } else { -normal }
    }

    /// Colour of the heat map, if it has values at all three corners.
    fn heat(&self, index: usize, at: &[f64; 3]) -> Option<Light> {
        let (map, range) = (self.options.heat_map.as_ref()?, self.range?);
        let mut t = 0.0;
        for (share, &corner) in at.iter().zip(&self.corners[index]) {
            let value = map.values.get(corner).filter(|v| v.is_finite())?;
            t += share * fraction(*value, range);
        }
        Some(from_srgb(map.colors.blend(t)))
    }

    /// How much of the sample a wireframe line hides.
    fn line_share(&self, facet: &Facet, lambda: &[f64; 3]) -> f64 {
        let Some(wireframe) = self.options.wireframe else {
            return 0.0;
        };
        // Either neighbour draws the half of the line on its side of the edge.
        let reach = 0.5 * wireframe.width * self.side as f64;
        let on_line = lambda.iter().zip(facet.heights).any(|(l, height)| l * height < reach);
        if on_line { wireframe.opacity.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Triangles whose corners exist and are finite.
fn valid_triangles(view: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<[usize; 3]> {
    let good: Vec<bool> = view.iter().map(|p| p.iter().all(|c| c.is_finite())).collect();
    let is_good = |corner: usize| good.get(corner).copied().unwrap_or(false);
    // One index stays free for "no triangle"; nobody has four billion triangles.
    let most = NONE as usize - 1;
    triangles
        .iter()
        .map(|t| t.map(|corner| corner as usize))
        .filter(|t| t.iter().all(|&corner| is_good(corner)))
        .take(most)
        .collect()
}

type SamplePoint = Option<Projected>;

/// Projected points in samples, y downwards.
fn picture_points(view: &[Vector3<f64>], camera: &Camera, grid: &Grid) -> Vec<SamplePoint> {
    let [scale, dx, dy] = camera.picture_scale(grid.columns() as f64, grid.rows() as f64);
    view.iter()
        .map(|p| {
            let mut p = camera.project(p)?;
            (p.x, p.y) = (p.x * scale + dx, dy - p.y * scale);
            Some(p)
        })
        .collect()
}

fn in_picture(points: &[SamplePoint], &[a, b, c]: &[usize; 3]) -> Option<[Projected; 3]> {
    Some([points[a]?, points[b]?, points[c]?])
}

fn blend(at: &[f64; 3], values: &[Vector3<f64>; 3]) -> Vector3<f64> {
    values[0] * at[0] + values[1] * at[1] + values[2] * at[2]
}
