//! The structures of RFC 3161 and of what carries them, as far as they are read here.
//!
//! `x509-tsp` and `cms` define most of them, but a token is to be checked as its authority sent it: `cms` reads
//! certificates and signed attributes into sorted sets and would write them anew before they are hashed, and
//! `x509-tsp` knows no fractions of a second. So the parts that are hashed stay whole here ([`Any`]).

use cms::content_info::CmsVersion;
use cms::signed_data::{EncapsulatedContentInfo, SignerIdentifier};
use der::Sequence;
use der::asn1::{Any, BitString, Int, ObjectIdentifier, OctetString};
use x509_cert::ext::Extensions;
use x509_cert::spki::AlgorithmIdentifierOwned;

/// id-ct-TSTInfo (RFC 3161, section 2.4.2), which the list of `const-oid` lacks.
pub(crate) const ID_CT_TST_INFO: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.16.1.4");

/// What is stamped (RFC 3161, section 2.4.1).
#[derive(Debug, Clone, PartialEq, Eq, Sequence)]
pub(crate) struct MessageImprint {
    pub(crate) hash_algorithm: AlgorithmIdentifierOwned,
    pub(crate) hashed_message: OctetString,
}

/// A request (RFC 3161, section 2.4.1), without the policy and the extensions, which are never asked for.
#[derive(Debug, Sequence)]
pub(crate) struct TimeStampReq {
    pub(crate) version: u8,
    pub(crate) message_imprint: MessageImprint,
    #[asn1(optional = "true")]
    pub(crate) nonce: Option<u64>,
    #[asn1(default = "Default::default")]
    pub(crate) cert_req: bool,
}

/// A reply (RFC 3161, section 2.4.2).
#[derive(Debug, Sequence)]
pub(crate) struct TimeStampResp {
    pub(crate) status: PkiStatusInfo,
    #[asn1(optional = "true")]
    pub(crate) token: Option<Any>,
}

/// How the authority took the request (RFC 3161, section 2.4.2). The words should be `UTF8String`s; some are not,
/// and a refusal with its words misread is better than none.
#[derive(Debug, Sequence)]
pub(crate) struct PkiStatusInfo {
    pub(crate) status: u8,
    #[asn1(optional = "true")]
    pub(crate) words: Option<Vec<Any>>,
    #[asn1(optional = "true")]
    pub(crate) failure: Option<BitString>,
}

/// What the authority signs (RFC 3161, section 2.4.2). The time stays as it is, because it may have fractions.
#[derive(Debug, Sequence)]
pub(crate) struct TstInfo {
    pub(crate) version: u8,
    pub(crate) policy: ObjectIdentifier,
    pub(crate) message_imprint: MessageImprint,
    pub(crate) serial_number: Int,
    pub(crate) gen_time: Any,
    #[asn1(optional = "true")]
    pub(crate) accuracy: Option<Accuracy>,
    #[asn1(default = "Default::default")]
    pub(crate) ordering: bool,
    #[asn1(optional = "true")]
    pub(crate) nonce: Option<Int>,
    #[asn1(context_specific = "0", tag_mode = "EXPLICIT", optional = "true")]
    pub(crate) tsa: Option<Any>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) extensions: Option<Extensions>,
}

/// How far the time may be off (RFC 3161, section 2.4.2).
#[derive(Debug, Sequence)]
pub(crate) struct Accuracy {
    #[asn1(optional = "true")]
    pub(crate) seconds: Option<u32>,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) millis: Option<u16>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) micros: Option<u16>,
}

/// Signed data (RFC 5652, section 5.1).
#[derive(Debug, Sequence)]
pub(crate) struct SignedData {
    pub(crate) version: CmsVersion,
    pub(crate) digest_algorithms: Any,
    pub(crate) content: EncapsulatedContentInfo,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) certificates: Option<Vec<Any>>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) crls: Option<Vec<Any>>,
    pub(crate) signers: Any,
}

/// One signature and what belongs to it (RFC 5652, section 5.3).
#[derive(Debug, Clone, PartialEq, Eq, Sequence)]
pub(crate) struct SignerInfo {
    pub(crate) version: CmsVersion,
    pub(crate) signer: SignerIdentifier,
    pub(crate) digest_algorithm: AlgorithmIdentifierOwned,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) signed_attributes: Option<Vec<Any>>,
    pub(crate) signature_algorithm: AlgorithmIdentifierOwned,
    pub(crate) signature: OctetString,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) unsigned_attributes: Option<Vec<Any>>,
}

/// The attribute that names the signer's certificate, of either age: `SigningCertificate` (RFC 2634, section 5.4) and
/// `SigningCertificateV2` (RFC 5035, section 3).
#[derive(Debug, Sequence)]
pub(crate) struct SigningCertificate {
    /// The first is the signer's.
    pub(crate) certificates: Vec<Any>,
    #[asn1(optional = "true")]
    pub(crate) policies: Option<Any>,
}

/// A certificate by its SHA-1. The issuer and serial number beside it say nothing that the hash does not.
#[derive(Debug, Sequence)]
pub(crate) struct EssCertId {
    pub(crate) hash: OctetString,
    #[asn1(optional = "true")]
    pub(crate) issuer_serial: Option<IssuerSerial>,
}

/// A certificate by a hash that is SHA-256 unless it says otherwise.
#[derive(Debug, Sequence)]
pub(crate) struct EssCertIdV2 {
    #[asn1(optional = "true")]
    pub(crate) hash_algorithm: Option<AlgorithmIdentifierOwned>,
    pub(crate) hash: OctetString,
    #[asn1(optional = "true")]
    pub(crate) issuer_serial: Option<IssuerSerial>,
}

/// Passed over, but read, so that nothing else can stand in its place.
#[derive(Debug, Clone, PartialEq, Eq, Sequence)]
pub(crate) struct IssuerSerial {
    pub(crate) issuer: Any,
    pub(crate) serial_number: Int,
}
