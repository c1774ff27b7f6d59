//! Timestamps by RFC 3161, as commands show them.

use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use serde::Serialize;
use sombrero::Commitment;
use sombrero::watermark::Key;
use sombrero_timestamp::{Token, TrustAnchors, Verified};
use std::path::Path;

/// Bundles of all authorities of a system have some 300 KB.
const LARGEST_BUNDLE: u64 = 16 << 20;

/// A token that was checked: whole, and of the right digest.
#[derive(Debug, Serialize)]
pub(crate) struct Stamp {
    /// RFC 3339, UTC.
    time: String,
    signer: String,
    serial: String,
    policy: String,
    /// Whether one of the given authorities vouches for the signer.
    trusted: bool,
    /// That authority: whoever asks others to believe a token may bring any.
    anchor: Option<Authority>,
}

#[derive(Debug, Serialize)]
struct Authority {
    subject: String,
    sha256: String,
}

impl Stamp {
    /// What it says of the key.
    pub(crate) fn commitment(&self) -> Commitment {
        Commitment { time: self.time.clone(), trusted: self.trusted }
    }

    /// For people.
    pub(crate) fn rows(&self) -> Table {
        let Self { time, signer, serial, .. } = self;
        let stamp = Table::default().row("timestamp", format!("{time} by {signer}, serial number {serial}"));
        match &self.anchor {
            Some(Authority { subject, sha256 }) => {
                stamp.row("trust", format!("by a certificate in --ca: {subject}")).row(
                    "fingerprint",
                    format!("SHA-256 {sha256}; compare it with what that authority publishes"),
                )
            }
            None => stamp.row(
                "trust",
                "not checked: anybody can sign a token; give the authority's certificate with --ca",
            ),
        }
    }
}

/// The certificates of `--ca`, or none.
pub(crate) fn anchors(path: Option<&Path>) -> Result<TrustAnchors, Failure> {
    let Some(path) = path else { return Ok(TrustAnchors::none()) };
    let pem = files::read_small(path, LARGEST_BUNDLE, "certificates in PEM")?;
    TrustAnchors::from_pem(&pem).map_err(|e| Failure::about("timestamp", path, &e))
}

/// Whether `token`, which `path` holds, is a good one for `digest`.
pub(crate) fn check(
    path: &Path,
    token: &[u8],
    digest: &[u8; 32],
    anchors: &TrustAnchors,
) -> Result<Stamp, Failure> {
    let wrong = |e: &dyn std::error::Error| Failure::about("timestamp", path, e);
    let token = Token::from_der(token).map_err(|e| wrong(&e))?;
    let Verified { time, signer, trusted, anchor, .. } =
        token.verify(digest, anchors).map_err(|e| wrong(&e))?;
    let anchor = anchor.map(|a| Authority { subject: a.subject, sha256: hex::encode(a.sha256) });
    let (serial, policy) = (token.serial().to_owned(), token.policy().to_owned());
    Ok(Stamp { time, signer, serial, policy, trusted, anchor })
}

/// The token that a key holds, checked; `path` is the key's.
pub(crate) fn of_key(path: &Path, key: &Key, anchors: &TrustAnchors) -> Result<Option<Stamp>, Failure> {
    key.timestamp.as_ref().map(|token| check(path, token, &key.stamped(), anchors)).transpose()
}
