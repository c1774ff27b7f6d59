#![doc = include_str!("../README.md")]

mod anchors;
mod asn1;
mod error;
mod request;
mod token;
mod verify;

pub use anchors::TrustAnchors;
pub use error::{AnchorError, TokenError};
pub use request::request;
pub use token::Token;
pub use verify::Verified;
