//! Hash algorithms by name.

use const_oid::db::rfc5912::{ID_MD_5, ID_SHA_1, ID_SHA_224, ID_SHA_256, ID_SHA_384, ID_SHA_512};
use der::asn1::ObjectIdentifier;

/// The common ones by name; those before SHA-2 can be made to collide, which is why nothing here takes them.
pub(crate) fn hash_name(oid: ObjectIdentifier) -> String {
    let name = match oid {
        ID_MD_5 => "MD5",
        ID_SHA_1 => "SHA-1",
        ID_SHA_224 => "SHA-224",
        ID_SHA_256 => "SHA-256",
        ID_SHA_384 => "SHA-384",
        ID_SHA_512 => "SHA-512",
        _ => return oid.to_string(),
    };
    format!("{name} ({oid})")
}
