//! The request.

use crate::asn1::{MessageImprint, TimeStampReq};
use const_oid::db::rfc5912::ID_SHA_256;
use der::Encode;
use der::asn1::{Any, OctetString};
use x509_cert::spki::AlgorithmIdentifierOwned;

/// The request (DER) to stamp `digest`, which is a SHA-256 (RFC 3161, section 2.4.1).
///
/// It asks for the signer's certificate in the token, without which nothing could be verified later, and leaves the
/// policy to the authority. Send it by HTTP POST with the content type `application/timestamp-query`.
///
/// The authority repeats `nonce`, if there is one: [`Token::check_nonce`](crate::Token::check_nonce) then tells this
/// answer from an older one. For a digest of something secret and new it is not needed.
#[must_use]
pub fn request(digest: &[u8; 32], nonce: Option<u64>) -> Vec<u8> {
    let message_imprint = MessageImprint {
        // The NULL may be left out, but there are authorities that miss it.
        hash_algorithm: AlgorithmIdentifierOwned { oid: ID_SHA_256, parameters: Some(Any::null()) },
        hashed_message: OctetString::new(*digest).expect("32 bytes are a length that DER can state"),
    };
    TimeStampReq { version: 1, message_imprint, nonce, cert_req: true }
        .to_der()
        .expect("fields of a few bytes each have a DER")
}
