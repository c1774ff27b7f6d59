//! From a mesh to a picture: project, find what is visible, shade it, average the samples of each pixel.
//!
//! The samples of a pixel are averaged in linear light with opacity multiplied in, which keeps edges clean on
//! transparent backgrounds. Cost: the triangles' bounding boxes in samples, plus one shading per visible sample.

use crate::camera::{Camera, used_points};
use crate::colormap::HeatMap;
use crate::grid::Grid;
use crate::image::Image;
use crate::light::{Light, encode, linear};
use crate::numerals;
use crate::options::RenderOptions;
use crate::raster::{Buffer, NONE};
use crate::scene::Scene;
use nalgebra::{Point3, Vector3};

/// Draws triangles, counter-clockwise seen from outside, with corners given as indices into `points` (model units).
///
/// There is always a picture. Triangles with an index out of range, a corner that is not finite, or no area are left
/// out, as are those that reach behind the eye; an empty mesh gives the background.
pub fn render(points: &[Point3<f64>], triangles: &[[u32; 3]], options: &RenderOptions) -> Image {
    let grid = Grid::new(options);
    let camera = options.camera.unwrap_or_else(|| default_camera(points, triangles));
    let scene = Scene::new(points, triangles, &camera, &grid, options);
    let mut buffer = Buffer::new(grid.columns(), grid.rows());
    for (index, facet) in (0..).zip(&scene.facets) {
        buffer.draw(facet, index);
    }
    let mut image = average(&scene, &buffer, &grid, options);
    if let (Some(map), true) = (&options.heat_map, grid.strip > 0) {
        draw_bar(&mut image, map, grid.strip, options.background);
    }
    image
}

fn default_camera(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Camera {
    Camera::framing(&used_points(points, triangles), Vector3::new(-0.45, -0.35, -1.0), Vector3::y())
}

/// Averages the samples of each pixel over the background.
fn average(scene: &Scene<'_>, buffer: &Buffer, grid: &Grid, options: &RenderOptions) -> Image {
    let mut image = Image::filled(grid.width as u32, grid.height as u32, options.background);
    let (bar_start, stride) = (grid.width - grid.strip, 4 * grid.width);
    for (row, pixels) in image.rgba.chunks_exact_mut(stride).enumerate() {
        for (column, pixel) in pixels.chunks_exact_mut(4).take(bar_start).enumerate() {
            let (sum, hits) = pixel_light(scene, buffer, grid.side, column, row);
            if hits > 0 {
                let all = (grid.side * grid.side) as f64;
                pixel.copy_from_slice(&over(&(sum / all), f64::from(hits) / all, options.background));
            }
        }
    }
    image
}

/// Sum of the light of a pixel's samples, and how many of them show a surface.
fn pixel_light(scene: &Scene<'_>, buffer: &Buffer, side: usize, column: usize, row: usize) -> (Light, u32) {
    let (mut sum, mut hits) = (Light::zeros(), 0);
    for y in row * side..(row + 1) * side {
        for x in column * side..(column + 1) * side {
            let winner = buffer.winner(x, y);
            if winner != NONE {
                sum += scene.shade(winner as usize, x as f64 + 0.5, y as f64 + 0.5);
                hits += 1;
            }
        }
    }
    (sum, hits)
}

/// Light of a surface that covers a share of the pixel, over a background; the light has the share multiplied in.
fn over(light: &Light, share: f64, background: [u8; 4]) -> [u8; 4] {
    let rest = (1.0 - share) * f64::from(background[3]) / 255.0;
    let opacity = share + rest;
    let channel = |i: usize| encode((light[i] + rest * linear(f64::from(background[i]))) / opacity);
    [channel(0), channel(1), channel(2), (opacity * 255.0 + 0.5) as u8]
}

/// The scale of colours in the strip at the right, high values on top, with the numbers of its ends and its middle where
/// there is room for them.
fn draw_bar(image: &mut Image, map: &HeatMap, strip: usize, background: [u8; 4]) {
    let colors = map.colors;
    let (width, height) = (image.width as usize, image.height as usize);
    let (top, bottom) = (height / 8, height - height / 8);
    let (left, right) = (width - 3 * strip / 4, width - strip / 4);
    for row in top..bottom {
        let t = 1.0 - (row - top) as f64 / (bottom - top - 1).max(1) as f64;
        let [r, g, b] = colors.color(t);
        for column in left..right {
            let at = 4 * (row * width + column);
            image.rgba[at..at + 4].copy_from_slice(&[r, g, b, 255]);
        }
    }
    let Some((low, high)) = map.effective_range() else { return };
    let labels = [high, 0.5 * low + 0.5 * high, low].map(numerals::short);
    // One size for all, with room around them.
    let fits = |label: &String| numerals::fitting(label, strip.saturating_sub(4), top / 3);
    let square = labels.iter().map(fits).min().unwrap_or(0);
    if square == 0 {
        return;
    }
    let rows = 5 * square;
    let places = [top.saturating_sub(rows + 2 * square), (top + bottom - rows) / 2, bottom + 2 * square];
    let middle_color = colors.color(0.5);
    let inks =
        [ink(background), ink([middle_color[0], middle_color[1], middle_color[2], 255]), ink(background)];
    for ((label, place), ink) in labels.iter().zip(places).zip(inks) {
        numerals::write(image, label, square, width - strip / 2, place, ink);
    }
}

/// Black or white, whatever is easier to read on a colour; grey where nobody knows what will be behind it.
fn ink(on: [u8; 4]) -> [u8; 4] {
    let [r, g, b] = [on[0], on[1], on[2]].map(|channel| linear(f64::from(channel)));
    let shade = match on[3] {
        0..128 => 128,
        _ if 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.18 => 0,
        _ => 255,
    };
    [shade, shade, shade, 255]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colormap::ColorMap;
    use crate::options::Wireframe;
    use proptest::prelude::*;

    const BLACK: [u8; 4] = [0, 0, 0, 255];

    /// An octahedron whose faces are split in four `depth` times, with all points on the unit sphere.
    fn sphere(depth: u32) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let mut faces: Vec<[Vector3<f64>; 3]> = Vec::new();
        for signs in 0..8 {
            let sign = |bit: i32| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let [x, y, z] = [Vector3::x() * sign(0), Vector3::y() * sign(1), Vector3::z() * sign(2)];
            faces.push(if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] });
        }
        for _ in 0..depth {
            let split = |[a, b, c]: [Vector3<f64>; 3]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(|m| m.normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            faces = faces.into_iter().flat_map(split).collect();
        }
        let triangles = (0..faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        (faces.into_iter().flatten().map(Point3::from).collect(), triangles)
    }

    /// A square of side two around (0, 0, z) that faces +z.
    fn square(z: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let corner = |x, y| Point3::new(x, y, z);
        let points = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        (points, vec![[0, 1, 2], [0, 2, 3]])
    }

    fn small() -> RenderOptions {
        RenderOptions { width: 100, height: 80, supersampling: 1, background: BLACK, ..Default::default() }
    }

    fn front(points: &[Point3<f64>]) -> Option<Camera> {
        Some(Camera::framing_orthographic(points, -Vector3::z(), Vector3::y()))
    }

    fn covered(image: &Image) -> usize {
        image.rgba.chunks_exact(4).filter(|p| **p != BLACK).count()
    }

    #[test]
    fn a_sphere_covers_its_disc() {
        let (points, triangles) = sphere(5);
        let options = RenderOptions { width: 300, height: 200, camera: front(&points), ..small() };
        let count = covered(&render(&points, &triangles, &options)) as f64;
        let radius = 0.88 * 100.0;
        let disc = std::f64::consts::PI * radius * radius;
        assert!((count / disc - 1.0).abs() < 0.01, "{count} of {disc}");
    }

    #[test]
    fn near_hides_far_and_backs_have_their_colour() {
        let (mut points, mut triangles) = square(0.0);
        // The nearer square turns its back.
        points.extend(square(1.0).0);
        triangles.extend([[4, 6, 5], [4, 7, 6]]);
        let options =
            RenderOptions { camera: front(&points), color: [0, 0, 255], back_color: [255, 0, 0], ..small() };
        for _ in 0..2 {
            let [r, _, b, _] = render(&points, &triangles, &options).pixel(50, 40).unwrap();
            assert!(r > 100 && b < 100, "{r} {b}");
            triangles.reverse();
        }
        let [r, _, b, _] = render(&points, &square(0.0).1, &options).pixel(50, 40).unwrap();
        assert!(b > 100 && r < 100, "{r} {b}");
    }

    #[test]
    fn same_input_same_bytes() {
        let (points, triangles) = sphere(3);
        let heat = HeatMap::new(points.iter().map(|p| p.x * p.y).collect());
        let options = RenderOptions {
            supersampling: 3,
            heat_map: Some(heat),
            wireframe: Some(Wireframe::default()),
            ..small()
        };
        let first = render(&points, &triangles, &options);
        assert_eq!(first, render(&points, &triangles, &options));
        assert_eq!(first.to_png().unwrap(), render(&points, &triangles, &options).to_png().unwrap());
    }

    /// Pinned, so that a machine or compiler that computes otherwise is noticed.
    #[test]
    fn bytes_are_the_same_on_every_machine() {
        let (points, triangles) = sphere(3);
        let image = render(&points, &triangles, &RenderOptions { supersampling: 2, ..small() });
        // FNV-1a
        let hash = image
            .rgba
            .iter()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, byte| (h ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
        assert_eq!(hash, PINNED, "{hash:#x}");
    }

    const PINNED: u64 = 0x8a7b_11d2_6415_9e1c;

    #[test]
    fn heat_map_colours_the_ends() {
        let (points, triangles) = square(0.0);
        let values = points.iter().map(|p| p.x).collect();
        let heat_map = Some(HeatMap { colors: ColorMap::CoolWarm, ..HeatMap::new(values) });
        let options = RenderOptions { heat_map, camera: front(&points), ..small() };
        let image = render(&points, &triangles, &options);
        // The bar takes 8 of 100 columns; the square's 70 are in the middle of the rest.
        let [r, _, b, _] = image.pixel(13, 40).unwrap();
        assert!(u32::from(b) > 2 * u32::from(r), "{r} {b}");
        let [r, _, b, _] = image.pixel(79, 40).unwrap();
        assert!(u32::from(r) > 2 * u32::from(b), "{r} {b}");
        assert_eq!(image.pixel(95, 10), Some([180, 4, 38, 255]));
        assert_eq!(image.pixel(95, 69), Some([59, 76, 192, 255]));
        assert_eq!(image.pixel(90, 40), Some(BLACK));
    }

    #[test]
    fn missing_heat_stays_clay() {
        let (points, triangles) = square(0.0);
        let clay = RenderOptions { camera: front(&points), ..small() };
        for values in [vec![], vec![f64::NAN; 4], vec![0.0]] {
            let heat_map = Some(HeatMap { bar: false, ..HeatMap::new(values) });
            let heat = RenderOptions { heat_map, ..clay.clone() };
            assert_eq!(render(&points, &triangles, &heat), render(&points, &triangles, &clay));
        }
    }

    #[test]
    fn wireframe_draws_the_diagonal_only_where_it_is() {
        let (points, triangles) = square(0.0);
        let wireframe = Some(Wireframe { width: 2.0, color: [255, 0, 0], opacity: 1.0 });
        let options = RenderOptions { camera: front(&points), wireframe, ..small() };
        let image = render(&points, &triangles, &options);
        assert_eq!(image.pixel(50, 39), Some([255, 0, 0, 255]));
        assert_ne!(image.pixel(60, 50), Some([255, 0, 0, 255]));
    }

    #[test]
    fn transparent_background_keeps_clean_edges() {
        let (points, triangles) = sphere(4);
        let clear = RenderOptions { background: [0; 4], supersampling: 3, ..small() };
        let image = render(&points, &triangles, &clear);
        assert_eq!(image.pixel(0, 0), Some([0; 4]));
        let soft = image.rgba.chunks_exact(4).filter(|p| p[3] > 0 && p[3] < 255);
        // An edge pixel is as bright as the surface, only less opaque: black does not bleed in.
        assert!(soft.clone().count() > 100);
        assert!(soft.clone().all(|p| p[0] > 60));
    }

    #[test]
    fn bad_input_gives_the_background() {
        let bad = Point3::new(f64::NAN, 0.0, f64::INFINITY);
        let (points, _) = square(0.0);
        let background = Image::filled(100, 80, BLACK);
        assert_eq!(render(&[], &[], &small()), background);
        assert_eq!(render(&[], &[[0, 1, 2]], &small()), background);
        assert_eq!(render(&points, &[[0, 1, 99], [u32::MAX; 3], [1, 1, 1]], &small()), background);
        assert_eq!(render(&[bad; 3], &[[0, 1, 2]], &small()), background);
        assert_eq!(render(&[Point3::origin(); 3], &[[0, 1, 2]], &small()), background);
        let behind = RenderOptions { camera: front(&square(0.0).0), ..small() };
        assert_eq!(covered(&render(&[Point3::new(1e300, 0.0, 0.0); 3], &[[0, 1, 2]], &behind)), 0);
    }

    #[test]
    fn odd_sizes_are_clamped() {
        let (points, triangles) = sphere(1);
        for (width, height, supersampling) in [(0, 0, 0), (1, 1, 99), (64, 1, 2), (3, 70, 1)] {
            let heat_map = Some(HeatMap::new(vec![1.0; points.len()]));
            let options = RenderOptions { width, height, supersampling, heat_map, ..small() };
            let image = render(&points, &triangles, &options);
            assert_eq!((image.width, image.height), (width.max(1), height.max(1)));
            assert!(image.to_png().is_ok());
        }
        let huge = RenderOptions { width: 4096, height: 4096, supersampling: 4, ..RenderOptions::default() };
        assert_eq!(Grid::new(&huge).side, 2);
    }

    #[test]
    fn model_units_do_not_matter() {
        let (points, triangles) = sphere(3);
        let plain = render(&points, &triangles, &small());
        // Powers of two scale without rounding.
        for scale in [2.0_f64.powi(-300), 2.0_f64.powi(300)] {
            let scaled: Vec<_> = points.iter().map(|p| p * scale).collect();
            assert_eq!(render(&scaled, &triangles, &small()), plain);
        }
    }

    proptest! {
        #[test]
        fn any_bits_give_a_picture(
            points in proptest::collection::vec(any::<[f64; 3]>(), 0..12),
            triangles in proptest::collection::vec(proptest::array::uniform3(0_u32..13), 0..12),
            direction in any::<[f64; 3]>(),
            values in proptest::collection::vec(any::<f64>(), 0..12),
            range in any::<Option<(f64, f64)>>(),
        ) {
            let points: Vec<_> = points.into_iter().map(Point3::from).collect();
            let camera = Some(Camera::framing(&points, Vector3::from(direction), Vector3::y()));
            for camera in [None, camera] {
                let heat_map = Some(HeatMap { range, ..HeatMap::new(values.clone()) });
                let options = RenderOptions { camera, heat_map, width: 70, height: 40, ..small() };
                prop_assert_eq!(render(&points, &triangles, &options).rgba.len(), 4 * 70 * 40);
            }
        }
    }
}
