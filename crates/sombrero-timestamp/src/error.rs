//! Why a token is none, or proves nothing.

use thiserror::Error;

/// Why a reply or token could not be read, or does not prove what it should.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TokenError {
    /// The bytes are not DER, or not of the structure of a reply or token.
    #[error(
        "not a time-stamp reply or token, or a damaged one ({part}: {detail}); use the authority's reply as it came, in DER"
    )]
    Syntax {
        /// The part that could not be read.
        part: &'static str,
        /// What is wrong with it.
        detail: String,
    },
    /// The authority gave no token.
    #[error(
        "the authority did not grant the time stamp ({status}) and says \"{words}\"; send the request again, or to another authority"
    )]
    Refused {
        /// The status, and the reason if one is named, by the names of RFC 3161.
        status: String,
        /// The authority's own words, empty if it has none.
        words: String,
    },
    /// The token stamps a hash that is not SHA-256.
    #[error(
        "the token stamps a digest by algorithm {algorithm}, not by SHA-256; use a token for this digest"
    )]
    Hash {
        /// The algorithm's name, if it is a common one, and object identifier.
        algorithm: String,
    },
    /// The token stamps something else.
    #[error("the token is for another digest: it stamps {found}, not {expected}; use the token for this one")]
    Digest {
        /// The digest that was asked about, in hex.
        expected: String,
        /// The digest in the token, in hex.
        found: String,
    },
    /// The token answers another request.
    #[error(
        "the token answers another request: its nonce is {found}, not {expected}; use the reply to this request"
    )]
    Nonce {
        /// The nonce that was asked about, in hex.
        expected: String,
        /// The nonce in the token, in hex, or "absent".
        found: String,
    },
    /// The certificate of the signer is not in the token.
    #[error(
        "the token lacks the certificate of its signer; get one with a request that asks for certificates"
    )]
    NoCertificate,
    /// A signed attribute is missing or does not fit.
    #[error("the token's signed attribute {attribute} {problem}; get a new token")]
    Attribute {
        /// Its name.
        attribute: &'static str,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The token's contents have an extension that must be understood, and is not.
    #[error("the token has a critical extension {oid}, which is unknown here; get a token without it")]
    Extension {
        /// Its object identifier.
        oid: String,
    },
    /// A hash or signature algorithm that is not supported.
    #[error(
        "the token uses {what} {algorithm}, which is not supported; get one from an authority with RSA or ECDSA and SHA-2"
    )]
    Algorithm {
        /// What it is used for.
        what: &'static str,
        /// Its object identifier, and its name if it is a common hash.
        algorithm: String,
    },
    /// The signature does not verify.
    #[error(
        "the signature is not that of {signer}: the token was changed, or made up; use the authority's reply as it came"
    )]
    Signature {
        /// The signer's name.
        signer: String,
    },
    /// The signer's certificate has something that is not supported.
    #[error("the certificate of {signer} cannot be used: {detail}; get a token from another authority")]
    Certificate {
        /// The signer's name.
        signer: String,
        /// What the verification of certificates says.
        detail: String,
    },
    /// The signer's certificate does not permit time stamps.
    #[error(
        "the certificate of {signer} is not one for time stamps: {problem}; get a token from a time-stamp authority"
    )]
    Usage {
        /// The signer's name.
        signer: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// No way leads from the signer's certificate to an anchor.
    #[error(
        "no trust anchor vouches for {signer}; give the root certificate of its authority, if you trust that"
    )]
    Untrusted {
        /// The signer's name.
        signer: String,
    },
    /// A certificate on the way to an anchor is not valid.
    #[error(
        "the certificates of {signer} do not lead to a trust anchor ({detail}); give the anchors of its authority, or get a new token"
    )]
    Chain {
        /// The signer's name.
        signer: String,
        /// What the verification of certificates says.
        detail: String,
    },
}

impl TokenError {
    pub(crate) fn syntax(part: &'static str, detail: impl ToString) -> Self {
        Self::Syntax { part, detail: detail.to_string() }
    }
}

/// Why a bundle gives no trust anchors.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AnchorError {
    /// There is no certificate in it.
    #[error("the trust anchors hold no certificate; give a file with `-----BEGIN CERTIFICATE-----` (PEM)")]
    Empty,
    /// A section is damaged.
    #[error(
        "section {number} of the trust anchors is not PEM: {detail}; give the file as its authority publishes it"
    )]
    Pem {
        /// Its place, from 1.
        number: usize,
        /// What is wrong with it.
        detail: String,
    },
    /// A certificate cannot be read.
    #[error("certificate {number} of the trust anchors cannot be read: {detail}; take it out, or replace it")]
    Certificate {
        /// Its place, from 1.
        number: usize,
        /// What is wrong with it.
        detail: String,
    },
}
