//! What the tests share.
#![allow(dead_code, reason = "not every test file needs all of it")]

use sombrero_timestamp::{Token, TrustAnchors};

/// SHA-256 of `a sombrero key`.
pub(crate) const DIGEST: [u8; 32] = [
    0xab, 0xd5, 0xb8, 0x9e, 0xb0, 0x3d, 0x03, 0xad, 0xa3, 0xc8, 0x59, 0xb9, 0xa6, 0x7c, 0x8d, 0x3f, 0x44,
    0x34, 0x4e, 0x42, 0x95, 0x03, 0x9d, 0xfd, 0x29, 0x97, 0x3b, 0x88, 0x2f, 0x8c, 0x0b, 0xa8,
];

pub(crate) fn data(name: &str) -> Vec<u8> {
    std::fs::read(format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

pub(crate) fn token(name: &str) -> Token {
    Token::from_der(&data(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

pub(crate) fn anchors(name: &str) -> TrustAnchors {
    TrustAnchors::from_pem(&data(name)).unwrap()
}

/// The token in a granted reply of OpenSSL, found without the code under test: it is all that follows on the status,
/// which is `30 03 02 01 00`, behind a header of four bytes.
pub(crate) fn token_out(reply: &[u8]) -> &[u8] {
    assert_eq!(reply[4..9], [0x30, 0x03, 0x02, 0x01, 0x00]);
    &reply[9..]
}
