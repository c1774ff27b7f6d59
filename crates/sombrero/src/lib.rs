#![doc = include_str!("../README.md")]

mod attack;
mod claim;
mod compare;
mod detect;
mod embed;
mod info;
mod prepared_basis;
mod trace;

pub use attack::{AttackFileError, AttackedFile, attack};
pub use claim::{CONVINCING, Claim, Commitment, Convinces, KEYS, SUSPECTS, TIMESTAMPS, settings_weight};
pub use compare::{CompareError, Comparison, compare};
pub use detect::{
    Alignment, DetectError, DetectOptions, Detection, Detector, FirstLook, Glancer, Measured, Method, Part,
    Variant, detect,
};
pub use embed::{DistortionReport, EmbedError, EmbedOptions, EmbedReport, Embedder, Marked, embed};
pub use info::{Corners, Info, info};
pub use prepared_basis::{PreparedBasis, PreparedBasisError};
pub use sombrero_search::{Glance, Model, SearchError, Stages, Suspect, When};
pub use trace::{Named, Rejected, Trace, Tracer};

pub use nalgebra;
pub use sombrero_attacks as attacks;
pub use sombrero_basis as basis;
pub use sombrero_extraction as extraction;
pub use sombrero_fidelity as fidelity;
pub use sombrero_io as io;
pub use sombrero_mesh as mesh;
pub use sombrero_progress as progress;
pub use sombrero_progressive as progressive;
pub use sombrero_registration as registration;
pub use sombrero_render as render;
pub use sombrero_resampling as resampling;
pub use sombrero_search as search;
pub use sombrero_shapes as shapes;
pub use sombrero_spatial as spatial;
pub use sombrero_spectral as spectral;
pub use sombrero_stats as stats;
pub use sombrero_watermark as watermark;
