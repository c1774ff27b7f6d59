//! Whom to trust.

use crate::AnchorError;
use crate::token::clean;
use der::Tag;
use der::asn1::AnyRef;
use ring::digest::{SHA256, digest};
use rustls_pki_types::pem::PemObject;
use rustls_pki_types::{CertificateDer, TrustAnchor};
use x509_cert::name::Name;

/// The certificates that are trusted without further proof, normally roots of time-stamp authorities.
///
/// What counts of them is name, public key and name constraints. They do not expire here: whoever gives a root trusts
/// it (RFC 5280, section 6.1.1).
#[derive(Debug, Clone, Default)]
pub struct TrustAnchors {
    anchors: Vec<TrustAnchor<'static>>,
    /// Of the whole certificates, in the same order.
    fingerprints: Vec<[u8; 32]>,
}

/// Who vouched for a signer. Anybody can make a certificate with any subject: the fingerprint is what to compare with
/// the one that the authority publishes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Anchor {
    /// The distinguished name, as RFC 4514 writes it: `CN=...,O=...`.
    pub subject: String,
    /// SHA-256 of the certificate in DER.
    pub sha256: [u8; 32],
}

impl TrustAnchors {
    /// Nobody is trusted: a verification without anchors tells only that a token is whole.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// All certificates of a PEM bundle. Other sections, and text between them, are passed over.
    ///
    /// # Errors
    ///
    /// [`AnchorError`] if there is no certificate, or one cannot be read. None is left out in silence: it might be the
    /// one that matters.
    pub fn from_pem(pem: &[u8]) -> Result<Self, AnchorError> {
        let mut all = Self::none();
        for (section, number) in CertificateDer::pem_slice_iter(pem).zip(1..) {
            let certificate =
                section.map_err(|e| AnchorError::Pem { number, detail: clean(&e.to_string()) })?;
            let anchor = webpki::anchor_from_trusted_cert(&certificate)
                .map_err(|e| AnchorError::Certificate { number, detail: e.to_string() })?;
            all.anchors.push(anchor.to_owned());
            let fingerprint = digest(&SHA256, &certificate);
            all.fingerprints.push(fingerprint.as_ref().try_into().expect("a SHA-256 has 32 bytes"));
        }
        if all.is_empty() { Err(AnchorError::Empty) } else { Ok(all) }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.anchors.len()
    }

    /// Whether nobody is trusted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.anchors.is_empty()
    }

    /// One of these anchors, in words.
    pub(crate) fn describe(&self, anchor: &TrustAnchor<'_>) -> Anchor {
        let known = self.anchors.iter().zip(&self.fingerprints).find(|(known, _)| *known == anchor);
        Anchor { subject: name(anchor), sha256: known.map_or([0; 32], |(_, sha256)| *sha256) }
    }

    pub(crate) fn as_slice(&self) -> &[TrustAnchor<'static>] {
        &self.anchors
    }
}

/// The distinguished name of an anchor, which keeps it without the header of its SEQUENCE.
fn name(anchor: &TrustAnchor<'_>) -> String {
    let name = AnyRef::new(Tag::Sequence, &anchor.subject).and_then(|any| any.decode_as::<Name>());
    name.map_or_else(|_| "an anchor with an unreadable name".into(), |name| clean(&name.to_string()))
}
