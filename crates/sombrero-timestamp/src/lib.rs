#![doc = include_str!("../README.md")]

mod anchors;
mod asn1;
mod error;
mod hashes;
mod request;
mod token;
mod verify;

pub use anchors::{Anchor, TrustAnchors};
pub use error::{AnchorError, TokenError};
pub use request::request;
pub use token::Token;
pub use verify::Verified;
