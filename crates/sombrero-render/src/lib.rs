#![doc = include_str!("../README.md")]

mod camera;
mod colormap;
mod image;
mod light;
mod normals;
mod raster;
mod render;

pub use camera::{Camera, used_points};
pub use colormap::{ColorMap, HeatMap};
pub use image::{Image, ImageError};
pub use normals::Shading;
pub use render::{RenderOptions, Wireframe, render};
