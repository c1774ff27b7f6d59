#![doc = include_str!("../README.md")]

mod camera;
mod colormap;
mod grid;
mod image;
mod light;
mod normals;
mod numerals;
mod options;
mod raster;
mod render;
mod scene;

pub use nalgebra;

pub use camera::{Camera, used_points};
pub use colormap::{ColorMap, HeatMap};
pub use image::{Image, ImageError};
pub use normals::Shading;
pub use options::{RenderOptions, Wireframe};
pub use render::render;
