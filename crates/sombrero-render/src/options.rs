//! What a picture shall look like.

use crate::camera::Camera;
use crate::colormap::HeatMap;
use crate::normals::Shading;

/// Size and look of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Pixels in a row, clamped to 1..=4096. Default 800.
    pub width: u32,
    /// Rows, clamped to 1..=4096. Default 800.
    pub height: u32,
    /// The view; `None` frames the mesh from the front, a little from the right and from above (+y up). Default `None`.
    pub camera: Option<Camera>,
    /// How normals blend. Default [`Shading::Creased`].
    pub shading: Shading,
    /// Samples along each side of a pixel, clamped to 1..=4 and to 64 million samples in all. Default 3.
    pub supersampling: u32,
    /// Colour where there is no surface, sRGB with opacity. Default an opaque warm white.
    pub background: [u8; 4],
    /// Colour of the surface, sRGB. Default clay.
    pub color: [u8; 3],
    /// Colour of the back of triangles, seen through holes. Default a darker, redder clay.
    pub back_color: [u8; 3],
    /// Draw the edges of the triangles; `None` draws none. Default `None`.
    pub wireframe: Option<Wireframe>,
    /// Colour the surface by a scalar per vertex; `None` leaves it clay. Default `None`.
    pub heat_map: Option<HeatMap>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            width: 800,
            height: 800,
            camera: None,
            shading: Shading::default(),
            supersampling: 3,
            background: [247, 246, 243, 255],
            color: [214, 203, 188],
            back_color: [150, 112, 96],
            wireframe: None,
            heat_map: None,
        }
    }
}

/// The look of drawn edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wireframe {
    /// Width in pixels. Default 1.
    pub width: f64,
    /// Colour, sRGB. Default a dark grey.
    pub color: [u8; 3],
    /// How much of the surface's colour a line hides, from 0 to 1. Default 0.6.
    pub opacity: f64,
}

impl Default for Wireframe {
    fn default() -> Self {
        Self { width: 1.0, color: [40, 42, 48], opacity: 0.6 }
    }
}
