#![doc = include_str!("../README.md")]

mod collapse;
mod connected;
mod edges;
mod facets;
mod hinges;
mod ids;
mod matching;
mod mesh;
mod parts;
mod planar;
mod rings;
mod scene;
mod sides;
mod smoothing;
mod soup;
mod umbrella;
mod validate;
mod weld;

pub mod geometry;
pub mod repair;
pub mod topology;

pub use nalgebra;

pub use collapse::{Collapse, CollapseError};
pub use connected::connected;
pub use edges::Edges;
pub use facets::Facets;
pub use hinges::{Hinge, hinges};
pub use ids::{EdgeId, FaceId, HalfedgeId, VertexId};
pub use matching::{Matchings, Misfit, VertexMatching, best_matchings, isomorphisms, match_connectivity};
pub use mesh::{Mesh, TopologyError};
pub use parts::{part, parts};
pub use planar::PlanarRegions;
pub use repair::repair;
pub use rings::Rings;
pub use scene::{Place, Scene};
pub use sides::lone_sides;
pub use smoothing::smoothing_modes;
pub use soup::{BoundingBox, Soup, vertex_normals};
pub use umbrella::Umbrella;
pub use validate::Violation;
pub use weld::{Weld, weld_and_repair};
