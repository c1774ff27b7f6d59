//! Whether a token proves anything.

use crate::asn1::{EssCertId, EssCertIdV2, ID_CT_TST_INFO, SigningCertificate};
use crate::hashes::hash_name;
use crate::token::Signer;
use crate::{Anchor, Token, TokenError, TrustAnchors};
use const_oid::db::rfc5911::{
    ID_AA_SIGNING_CERTIFICATE, ID_AA_SIGNING_CERTIFICATE_V_2, ID_CONTENT_TYPE, ID_MESSAGE_DIGEST,
};
use const_oid::db::rfc5912::{
    ECDSA_WITH_SHA_256, ECDSA_WITH_SHA_384, ID_CE_EXT_KEY_USAGE, ID_KP_TIME_STAMPING, ID_RSASSA_PSS,
    ID_SHA_256, ID_SHA_384, ID_SHA_512, RSA_ENCRYPTION, SHA_256_WITH_RSA_ENCRYPTION,
    SHA_384_WITH_RSA_ENCRYPTION, SHA_512_WITH_RSA_ENCRYPTION,
};
use der::asn1::{Any, ObjectIdentifier, OctetStringRef};
use der::{Decode, Encode, Tag};
use ring::digest;
use rustls_pki_types::{CertificateDer, SignatureVerificationAlgorithm, UnixTime};
use webpki::{EndEntityCert, KeyUsage, ring as algorithms};
use x509_cert::attr::Attribute;
use x509_cert::ext::pkix::{ExtendedKeyUsage, KeyUsage as KeyUsageBits};

/// What a verification found.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verified {
    /// When the digest existed at the latest, as [`Token::time`] writes it.
    pub time: String,
    /// The distinguished name in the signer's certificate.
    pub signer: String,
    /// Whether a trust anchor vouches for the signer. If not, anybody can have made the token, with any time in it.
    pub trusted: bool,
    /// That anchor.
    pub anchor: Option<Anchor>,
}

impl Token {
    /// Verifies that the signer stamped `digest`, and that one of `anchors` vouched for the signer at the token's time.
    ///
    /// In detail: the stamped digest; the signed attributes (RFC 5652, section 11; RFC 5035, section 3), which must bind
    /// the contents and the signer's certificate; the signature (RFC 5652, section 5.4); the certificate's one purpose
    /// (RFC 3161, section 2.3); and the chain of certificates (RFC 5280, section 6), each valid at the token's time.
    /// Today's date plays no part, and neither does revocation.
    ///
    /// With [`TrustAnchors::none`] all but the chain is verified, and [`Verified::trusted`] is false: the token is
    /// whole, but anybody can have made it.
    ///
    /// # Errors
    ///
    /// The [`TokenError`] that names the first of these that fails.
    pub fn verify(&self, digest: &[u8; 32], anchors: &TrustAnchors) -> Result<Verified, TokenError> {
        if self.digest() != digest {
            let (expected, found) = (hex::encode(digest), hex::encode(self.digest()));
            return Err(TokenError::Digest { expected, found });
        }
        if let Some(oid) = &self.stamp.critical {
            return Err(TokenError::Extension { oid: oid.clone() });
        }
        self.verify_attributes()?;
        self.verify_signature()?;
        verify_purpose(&self.signer)?;
        let anchor = if anchors.is_empty() { None } else { Some(self.verify_chain(anchors)?) };
        let (time, signer) = (self.time().to_owned(), self.signer().to_owned());
        Ok(Verified { time, signer, trusted: anchor.is_some(), anchor })
    }

    /// That the attributes, which are what is signed, speak of these contents and of this certificate.
    fn verify_attributes(&self) -> Result<(), TokenError> {
        let attributes = Attributes::read(self.info.signed_attributes.as_deref().unwrap_or_default())?;
        let kind = attributes.one(ID_CONTENT_TYPE, "content-type")?;
        if kind.is_none_or(|value| value.decode_as() != Ok(ID_CT_TST_INFO)) {
            return Err(unfit("content-type", "does not say that this is a time stamp"));
        }
        let hash = hash(self.info.digest_algorithm.oid)?;
        let stated = attributes.one(ID_MESSAGE_DIGEST, "message-digest")?;
        if stated.is_none_or(|value| !is_digest(value, digest::digest(hash, &self.content).as_ref())) {
            return Err(unfit("message-digest", "is not that of the contents"));
        }
        self.verify_certificate_named(&attributes)
    }

    /// Without this a certificate of the same key with other contents could be put in place of the signer's.
    fn verify_certificate_named(&self, attributes: &Attributes) -> Result<(), TokenError> {
        let old = attributes.one(ID_AA_SIGNING_CERTIFICATE, "signing-certificate")?;
        let new = attributes.one(ID_AA_SIGNING_CERTIFICATE_V_2, "signing-certificate-v2")?;
        if old.is_none() && new.is_none() {
            return Err(unfit("signing-certificate-v2", "is missing"));
        }
        if old.is_some_and(|value| names_sha1(value, &self.signer.der).is_none()) {
            return Err(unfit("signing-certificate", "does not name the certificate of the signer"));
        }
        if new.is_some_and(|value| names_sha2(value, &self.signer.der).is_none()) {
            return Err(unfit("signing-certificate-v2", "does not name the certificate of the signer"));
        }
        Ok(())
    }

    fn verify_signature(&self) -> Result<(), TokenError> {
        let info = &self.info;
        let algorithms = signature_algorithms(info.signature_algorithm.oid, info.digest_algorithm.oid)?;
        let signed = info.signed_attributes.to_der().and_then(as_set);
        let signed = signed.map_err(|e| TokenError::syntax("signed attributes", e))?;
        let der = CertificateDer::from(self.signer.der.as_slice());
        let certificate = self.signer.end_entity(&der)?;
        let signature = info.signature.as_bytes();
        // Which of them fits is a matter of the key, which the certificate states; for any other they fail.
        if algorithms.iter().any(|a| certificate.verify_signature(*a, &signed, signature).is_ok()) {
            return Ok(());
        }
        Err(TokenError::Signature { signer: self.signer.name.clone() })
    }

    /// The anchor at the end of the chain.
    fn verify_chain(&self, anchors: &TrustAnchors) -> Result<Anchor, TokenError> {
        let der = CertificateDer::from(self.signer.der.as_slice());
        let certificate = self.signer.end_entity(&der)?;
        let others = self.certificates.iter().map(|der| CertificateDer::from(der.as_slice()));
        let others: Vec<_> = others.collect();
        let time = UnixTime::since_unix_epoch(self.stamp.unix);
        // That the signer's own usage is there was verified already. Other certificates need not have one.
        let usage = KeyUsage::required_if_present(TIME_STAMPING.as_bytes());
        let path = certificate.verify_for_usage(
            webpki::ALL_VERIFICATION_ALGS,
            anchors.as_slice(),
            &others,
            time,
            usage,
            None,
            None,
        );
        path.map(|path| anchors.describe(path.anchor())).map_err(|e| self.chain_error(&e))
    }

    fn chain_error(&self, error: &webpki::Error) -> TokenError {
        let signer = self.signer.name.clone();
        match error {
            webpki::Error::UnknownIssuer => TokenError::Untrusted { signer },
            other => TokenError::Chain { signer, detail: reason(other) },
        }
    }
}

impl Signer {
    fn end_entity<'a>(&self, der: &'a CertificateDer<'a>) -> Result<EndEntityCert<'a>, TokenError> {
        EndEntityCert::try_from(der)
            .map_err(|e| TokenError::Certificate { signer: self.name.clone(), detail: e.to_string() })
    }
}

/// The common reasons in words. The others are rare enough to be looked up.
fn reason(error: &webpki::Error) -> String {
    use webpki::Error as E;
    let words = match error {
        E::CertExpired { .. } => "a certificate had expired at the time of the stamp",
        E::CertNotValidYet { .. } => "a certificate was not valid yet at the time of the stamp",
        E::InvalidSignatureForPublicKey => "a certificate is not signed with the key of its issuer",
        E::EndEntityUsedAsCa => "a certificate was issued by one that may not issue any",
        E::CaUsedAsEndEntity => "the certificate of the signer is one for issuing others",
        E::UnsupportedSignatureAlgorithmContext(_) => {
            "a certificate is signed by an algorithm that is too weak, such as one with SHA-1, or is not supported"
        }
        E::RequiredEkuNotFoundContext(_) => "the certificate of an issuer is not for time stamps",
        other => return other.to_string(),
    };
    words.to_owned()
}

/// The same as a place in memory, which `webpki` borrows for good.
static TIME_STAMPING: ObjectIdentifier = ID_KP_TIME_STAMPING;

/// That the certificate is for time stamps, and for nothing else (RFC 3161, section 2.3).
fn verify_purpose(signer: &Signer) -> Result<(), TokenError> {
    let unusable = |problem| TokenError::Usage { signer: signer.name.clone(), problem };
    let tbs = &signer.certificate.tbs_certificate;
    let mut usages = tbs.extensions.iter().flatten().filter(|e| e.extn_id == ID_CE_EXT_KEY_USAGE);
    let (Some(usage), None) = (usages.next(), usages.next()) else {
        return Err(unusable("it does not have one extended key usage"));
    };
    let purposes = ExtendedKeyUsage::from_der(usage.extn_value.as_bytes());
    if purposes.map(|usage| usage.0).as_deref() != Ok(&[ID_KP_TIME_STAMPING]) {
        return Err(unusable("its extended key usage is not time stamping alone"));
    }
    if !usage.critical {
        return Err(unusable("its extended key usage is not critical"));
    }
    // RFC 5280, section 4.2.1.12: the two key usages that go with time stamping.
    match tbs.get::<KeyUsageBits>() {
        Ok(None) => Ok(()),
        Ok(Some((_, bits))) if bits.digital_signature() || bits.non_repudiation() => Ok(()),
        _ => Err(unusable("its key usage does not permit signatures")),
    }
}

/// Signed attributes, each of which is a set of values (RFC 5652, section 5.3).
struct Attributes(Vec<Attribute>);

impl Attributes {
    fn read(attributes: &[Any]) -> Result<Self, TokenError> {
        let read: der::Result<Vec<Attribute>> = attributes.iter().map(Any::decode_as).collect();
        read.map(Self).map_err(|e| TokenError::syntax("signed attributes", e))
    }

    /// The only value of an attribute that there can be once at most.
    fn one(&self, oid: ObjectIdentifier, name: &'static str) -> Result<Option<&Any>, TokenError> {
        let mut found = self.0.iter().filter(|attribute| attribute.oid == oid);
        match (found.next(), found.next()) {
            (None, _) => Ok(None),
            (Some(only), None) if only.values.len() == 1 => Ok(only.values.get(0)),
            _ => Err(unfit(name, "is there more than once, or without a value")),
        }
    }
}

fn unfit(attribute: &'static str, problem: &'static str) -> TokenError {
    TokenError::Attribute { attribute, problem }
}

/// The bytes under the signature: the attributes as they came, but tagged as the SET that they are
/// (RFC 5652, section 5.4). Here they were read as a SEQUENCE, which keeps their order.
fn as_set(mut sequence: Vec<u8>) -> der::Result<Vec<u8>> {
    let tag = sequence.first_mut().ok_or(der::ErrorKind::Failed)?;
    *tag = Tag::Set.octet();
    Ok(sequence)
}

fn is_digest(value: &Any, digest: &[u8]) -> bool {
    value.decode_as::<OctetStringRef<'_>>().is_ok_and(|octets| octets.as_bytes() == digest)
}

/// SHA-1 can be made to collide, but for this an authority would have to forge its own certificate.
fn names_sha1(value: &Any, certificate: &[u8]) -> Option<()> {
    let named = value.decode_as::<SigningCertificate>().ok()?;
    let first = named.certificates.first()?.decode_as::<EssCertId>().ok()?;
    let actual = digest::digest(&digest::SHA1_FOR_LEGACY_USE_ONLY, certificate);
    (first.hash.as_bytes() == actual.as_ref()).then_some(())
}

fn names_sha2(value: &Any, certificate: &[u8]) -> Option<()> {
    let named = value.decode_as::<SigningCertificate>().ok()?;
    let first = named.certificates.first()?.decode_as::<EssCertIdV2>().ok()?;
    let algorithm = first.hash_algorithm.map_or(ID_SHA_256, |algorithm| algorithm.oid);
    let actual = digest::digest(hash(algorithm).ok()?, certificate);
    (first.hash.as_bytes() == actual.as_ref()).then_some(())
}

fn hash(oid: ObjectIdentifier) -> Result<&'static digest::Algorithm, TokenError> {
    match oid {
        ID_SHA_256 => Ok(&digest::SHA256),
        ID_SHA_384 => Ok(&digest::SHA384),
        ID_SHA_512 => Ok(&digest::SHA512),
        _ => Err(TokenError::Algorithm { what: "the hash algorithm", algorithm: hash_name(oid) }),
    }
}

/// What a signature algorithm and the hash beside it can mean. Where both name a hash it must be the same one
/// (RFC 8933, section 3). The parameters of RSA-PSS are not read: the hash follows from beside, and the salt must be
/// as long as the hash.
fn signature_algorithms(
    signature: ObjectIdentifier,
    hash: ObjectIdentifier,
) -> Result<Vec<&'static dyn SignatureVerificationAlgorithm>, TokenError> {
    use algorithms as a;
    Ok(match (signature, hash) {
        (RSA_ENCRYPTION | SHA_256_WITH_RSA_ENCRYPTION, ID_SHA_256) => vec![a::RSA_PKCS1_2048_8192_SHA256],
        (RSA_ENCRYPTION | SHA_384_WITH_RSA_ENCRYPTION, ID_SHA_384) => vec![a::RSA_PKCS1_2048_8192_SHA384],
        (RSA_ENCRYPTION | SHA_512_WITH_RSA_ENCRYPTION, ID_SHA_512) => vec![a::RSA_PKCS1_2048_8192_SHA512],
        (ID_RSASSA_PSS, ID_SHA_256) => vec![a::RSA_PSS_2048_8192_SHA256_LEGACY_KEY],
        (ID_RSASSA_PSS, ID_SHA_384) => vec![a::RSA_PSS_2048_8192_SHA384_LEGACY_KEY],
        (ID_RSASSA_PSS, ID_SHA_512) => vec![a::RSA_PSS_2048_8192_SHA512_LEGACY_KEY],
        (ECDSA_WITH_SHA_256, ID_SHA_256) => vec![a::ECDSA_P256_SHA256, a::ECDSA_P384_SHA256],
        (ECDSA_WITH_SHA_384, ID_SHA_384) => vec![a::ECDSA_P256_SHA384, a::ECDSA_P384_SHA384],
        _ => {
            let algorithm = format!("{signature} with hash {hash}");
            return Err(TokenError::Algorithm { what: "the signature algorithm", algorithm });
        }
    })
}
