//! Reading a reply or token.

use crate::TokenError;
use crate::asn1::{Accuracy, ID_CT_TST_INFO, PkiStatusInfo, SignedData, SignerInfo, TimeStampResp, TstInfo};
use crate::hashes::hash_name;
use cms::content_info::ContentInfo;
use cms::signed_data::SignerIdentifier;
use const_oid::db::rfc5911::ID_SIGNED_DATA;
use const_oid::db::rfc5912::ID_SHA_256;
use der::asn1::{Any, AnyRef, Int, OctetStringRef};
use der::{DateTime, Decode, Encode, Reader, SliceReader, Tag, Tagged};
use std::time::Duration;
use x509_cert::Certificate;
use x509_cert::ext::pkix::SubjectKeyIdentifier;

/// A time-stamp token (RFC 3161, section 2.4.2) that has been read.
///
/// To be read says nothing about who made it. What the methods here tell is to be believed after [`Token::verify`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    der: Vec<u8>,
    pub(crate) stamp: Stamp,
    /// The DER that `stamp` was read from, which is what is hashed.
    pub(crate) content: Vec<u8>,
    pub(crate) info: SignerInfo,
    /// All certificates that came with the token.
    pub(crate) certificates: Vec<Vec<u8>>,
    pub(crate) signer: Signer,
}

/// The contents of [`TstInfo`] in plain terms.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stamp {
    digest: [u8; 32],
    time: String,
    /// The same, in whole seconds since 1970.
    pub(crate) unix: Duration,
    serial: String,
    policy: String,
    nonce: Option<String>,
    accuracy: Option<Duration>,
    /// The first extension that would have to be understood.
    pub(crate) critical: Option<String>,
}

/// The certificate that the signature is said to be by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Signer {
    pub(crate) certificate: Certificate,
    /// As it came.
    pub(crate) der: Vec<u8>,
    pub(crate) name: String,
}

impl Token {
    /// Reads an authority's reply (`TimeStampResp`) or the token out of one (`TimeStampToken`), in DER.
    ///
    /// # Errors
    ///
    /// [`TokenError::Refused`] with the authority's words if it gave no token, [`TokenError::Hash`] if what is stamped
    /// is not a SHA-256, [`TokenError::NoCertificate`] if the signer's certificate is missing, and
    /// [`TokenError::Syntax`] for anything that is not a token.
    pub fn from_der(bytes: &[u8]) -> Result<Self, TokenError> {
        let outer = AnyRef::from_der(bytes).map_err(|e| TokenError::syntax("outer structure", e))?;
        // Both are a SEQUENCE; a token begins with an object identifier, a reply with its status.
        let first = SliceReader::new(outer.value()).and_then(|reader| reader.peek_tag());
        match first {
            Ok(Tag::ObjectIdentifier) => Self::from_token(bytes),
            _ => Self::from_token(&granted(bytes)?),
        }
    }

    fn from_token(der: &[u8]) -> Result<Self, TokenError> {
        let signed = signed_data(der)?;
        let content = content(&signed)?;
        let info = signer_info(&signed)?;
        let certificates = certificates(signed.certificates)?;
        let signer = Signer::find(&info.signer, &certificates).ok_or(TokenError::NoCertificate)?;
        let stamp = Stamp::read(&content)?;
        Ok(Self { der: der.to_vec(), stamp, content, info, certificates, signer })
    }

    /// The token's DER, without the reply around it: what to keep.
    #[must_use]
    pub fn to_der(&self) -> &[u8] {
        &self.der
    }

    /// The digest that is stamped, a SHA-256.
    #[must_use]
    pub fn digest(&self) -> &[u8; 32] {
        &self.stamp.digest
    }

    /// When, by the authority's clock, in UTC as RFC 3339 writes it: `2026-11-22T16:29:23Z`. With as many digits of a
    /// fraction as the authority gave.
    #[must_use]
    pub fn time(&self) -> &str {
        &self.stamp.time
    }

    /// How far the time may be off to either side, if the authority says.
    #[must_use]
    pub fn accuracy(&self) -> Option<Duration> {
        self.stamp.accuracy
    }

    /// The token's serial number in hex, without leading zeros. The authority gives each number once.
    #[must_use]
    pub fn serial(&self) -> &str {
        &self.stamp.serial
    }

    /// The object identifier of the policy that the authority followed, such as `1.3.6.1.4.1.99999.1`.
    #[must_use]
    pub fn policy(&self) -> &str {
        &self.stamp.policy
    }

    /// The nonce of the request in hex, without leading zeros, if it had one.
    #[must_use]
    pub fn nonce(&self) -> Option<&str> {
        self.stamp.nonce.as_deref()
    }

    /// The distinguished name in the signer's certificate, as RFC 4514 writes it: `CN=...,O=...`.
    ///
    /// Anybody can make a certificate with any name.
    #[must_use]
    pub fn signer(&self) -> &str {
        &self.signer.name
    }

    /// Whether the token answers the request with this nonce.
    ///
    /// # Errors
    ///
    /// [`TokenError::Nonce`] if it has another or none.
    pub fn check_nonce(&self, nonce: u64) -> Result<(), TokenError> {
        let expected = format!("{nonce:x}");
        match self.nonce() {
            Some(found) if found == expected => Ok(()),
            found => Err(TokenError::Nonce { expected, found: found.unwrap_or("absent").into() }),
        }
    }
}

/// The token in a reply.
fn granted(bytes: &[u8]) -> Result<Vec<u8>, TokenError> {
    let reply = TimeStampResp::from_der(bytes).map_err(|e| TokenError::syntax("reply", e))?;
    // 0 is "granted", 1 "granted with modifications", which the token itself shows.
    if reply.status.status > 1 {
        return Err(refusal(&reply.status));
    }
    let token = reply.token.ok_or_else(|| TokenError::syntax("reply", "granted, but without a token"))?;
    token.to_der().map_err(|e| TokenError::syntax("reply", e))
}

fn refusal(info: &PkiStatusInfo) -> TokenError {
    let status = match info.status {
        2 => "rejection".to_owned(),
        3 => "waiting".to_owned(),
        4 => "revocationWarning".to_owned(),
        5 => "revocationNotification".to_owned(),
        other => format!("status {other}"),
    };
    let set = |bit: usize| info.failure.as_ref().is_some_and(|bits| bits.bits().nth(bit) == Some(true));
    let reasons = FAILURES.iter().filter(|(bit, _)| set(*bit)).map(|(_, name)| *name);
    let status = std::iter::once(status.as_str()).chain(reasons).collect::<Vec<_>>().join(", ");
    let texts = info.words.iter().flatten().map(|text| clean(&String::from_utf8_lossy(text.value())));
    let words = texts.collect::<Vec<_>>().join(" ");
    TokenError::Refused { status, words }
}

/// The bits of `PKIFailureInfo` that an authority may set (RFC 3161, section 2.4.2).
const FAILURES: [(usize, &str); 8] = [
    (0, "badAlg"),
    (2, "badRequest"),
    (5, "badDataFormat"),
    (14, "timeNotAvailable"),
    (15, "unacceptedPolicy"),
    (16, "unacceptedExtension"),
    (17, "addInfoNotAvailable"),
    (25, "systemFailure"),
];

fn signed_data(der: &[u8]) -> Result<SignedData, TokenError> {
    let outer = ContentInfo::from_der(der).map_err(|e| TokenError::syntax("token", e))?;
    if outer.content_type != ID_SIGNED_DATA {
        return Err(TokenError::syntax("token", format!("content {}, not signed data", outer.content_type)));
    }
    outer.content.decode_as().map_err(|e| TokenError::syntax("signed data", e))
}

fn content(signed: &SignedData) -> Result<Vec<u8>, TokenError> {
    let kind = signed.content.econtent_type;
    if kind != ID_CT_TST_INFO {
        return Err(TokenError::syntax("signed data", format!("content {kind}, not a time stamp")));
    }
    let content = signed.content.econtent.as_ref();
    let content = content.ok_or_else(|| TokenError::syntax("signed data", "without its content"))?;
    let octets = content.decode_as::<OctetStringRef<'_>>();
    octets.map(|o| o.as_bytes().to_vec()).map_err(|e| TokenError::syntax("content", e))
}

/// The one signature (RFC 3161, section 2.4.2: no other than the authority's).
fn signer_info(signed: &SignedData) -> Result<SignerInfo, TokenError> {
    let fail = |e| TokenError::syntax("signature", e);
    signed.signers.tag().assert_eq(Tag::Set).map_err(fail)?;
    SignerInfo::from_der(signed.signers.value()).map_err(fail)
}

/// The certificates as they came. Other kinds (RFC 5652, section 10.2.2) have other tags, and no use here.
fn certificates(set: Option<Vec<Any>>) -> Result<Vec<Vec<u8>>, TokenError> {
    let certificates = set.into_iter().flatten().filter(|any| any.tag() == Tag::Sequence);
    certificates.map(|any| any.to_der().map_err(|e| TokenError::syntax("certificates", e))).collect()
}

impl Signer {
    fn find(identifier: &SignerIdentifier, certificates: &[Vec<u8>]) -> Option<Self> {
        certificates.iter().find_map(|der| {
            // One that cannot be read is not the signer's, and the chain may do without it.
            let certificate = Certificate::from_der(der).ok()?;
            let name = clean(&certificate.tbs_certificate.subject.to_string());
            is_meant(identifier, &certificate).then(|| Self { certificate, der: der.clone(), name })
        })
    }
}

fn is_meant(identifier: &SignerIdentifier, certificate: &Certificate) -> bool {
    let tbs = &certificate.tbs_certificate;
    match identifier {
        SignerIdentifier::IssuerAndSerialNumber(id) => {
            id.issuer == tbs.issuer && id.serial_number == tbs.serial_number
        }
        SignerIdentifier::SubjectKeyIdentifier(id) => {
            matches!(tbs.get::<SubjectKeyIdentifier>(), Ok(Some((_, key))) if key == *id)
        }
    }
}

impl Stamp {
    fn read(der: &[u8]) -> Result<Self, TokenError> {
        let info = TstInfo::from_der(der).map_err(|e| TokenError::syntax("content", e))?;
        if info.version != 1 {
            return Err(TokenError::syntax("content", format!("version {}, not 1", info.version)));
        }
        let (time, unix) =
            time(&info.gen_time).ok_or_else(|| TokenError::syntax("content", "not a UTC time"))?;
        let critical = info.extensions.iter().flatten().find(|extension| extension.critical);
        Ok(Self {
            digest: digest(&info)?,
            time,
            unix,
            serial: hexadecimal(&info.serial_number),
            policy: info.policy.to_string(),
            nonce: info.nonce.as_ref().map(hexadecimal),
            accuracy: info.accuracy.as_ref().map(duration),
            critical: critical.map(|extension| extension.extn_id.to_string()),
        })
    }
}

fn digest(info: &TstInfo) -> Result<[u8; 32], TokenError> {
    let imprint = &info.message_imprint;
    let algorithm = &imprint.hash_algorithm;
    if algorithm.oid != ID_SHA_256 || algorithm.parameters.as_ref().is_some_and(|p| !p.is_null()) {
        return Err(TokenError::Hash { algorithm: hash_name(algorithm.oid) });
    }
    let length = |_| TokenError::syntax("content", "a SHA-256 that is not 32 bytes long");
    imprint.hashed_message.as_bytes().try_into().map_err(length)
}

/// RFC 3339 text, and seconds since 1970, of a `GeneralizedTime` in UTC with or without a fraction
/// (RFC 3161, section 2.4.2). `der` has a reader for those without.
fn time(any: &Any) -> Option<(String, Duration)> {
    let text = std::str::from_utf8(any.value()).ok().filter(|_| any.tag() == Tag::GeneralizedTime)?;
    let text = text.strip_suffix('Z')?;
    let (whole, fraction) = text.split_once('.').map_or((text, None), |(w, f)| (w, Some(f)));
    let digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.len() != 14 || !digits(whole) {
        return None;
    }
    // DER writes no zeros at the end of a fraction, and no point without a fraction.
    if fraction.is_some_and(|f| !digits(f) || f.is_empty() || f.ends_with('0')) {
        return None;
    }
    let part = |from: usize| whole[from..from + 2].parse::<u8>().ok();
    let (month, day, hour, minute, second) = (part(4)?, part(6)?, part(8)?, part(10)?, part(12)?);
    let date = DateTime::new(whole[..4].parse().ok()?, month, day, hour, minute, second).ok()?;
    let fraction = fraction.map(|f| format!(".{f}")).unwrap_or_default();
    let year = date.year();
    let text = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{fraction}Z");
    Some((text, date.unix_duration()))
}

/// An INTEGER of any length. Serial numbers are positive (RFC 5280, section 4.1.2.2), but not all authorities know.
fn hexadecimal(number: &Int) -> String {
    let bytes = number.as_bytes();
    let negative = bytes.first().is_some_and(|b| b & 0x80 != 0);
    let magnitude = if negative { negated(bytes) } else { bytes.to_vec() };
    let text = hex::encode(magnitude);
    let digits = text.trim_start_matches('0');
    let digits = if digits.is_empty() { "0" } else { digits };
    format!("{}{digits}", if negative { "-" } else { "" })
}

/// The two's complement.
fn negated(bytes: &[u8]) -> Vec<u8> {
    let mut result: Vec<u8> = bytes.iter().map(|b| !b).collect();
    for byte in result.iter_mut().rev() {
        *byte = byte.wrapping_add(1);
        if *byte != 0 {
            break;
        }
    }
    result
}

fn duration(accuracy: &Accuracy) -> Duration {
    Duration::from_secs(accuracy.seconds.unwrap_or(0).into())
        + Duration::from_millis(accuracy.millis.unwrap_or(0).into())
        + Duration::from_micros(accuracy.micros.unwrap_or(0).into())
}

/// Text by strangers that goes to a terminal or into a report: without control characters.
pub(crate) fn clean(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<String> {
        time(&Any::new(Tag::GeneralizedTime, text.as_bytes()).unwrap()).map(|(text, _)| text)
    }

    #[test]
    fn times_are_utc_with_or_without_a_fraction() {
        assert_eq!(read("20261122162923Z").as_deref(), Some("2026-11-22T16:29:23Z"));
        assert_eq!(read("20240229000000.125Z").as_deref(), Some("2024-02-29T00:00:00.125Z"));
        let at = Any::new(Tag::GeneralizedTime, &b"19700102000001.5Z"[..]).unwrap();
        assert_eq!(time(&at).unwrap().1, Duration::from_secs(86_401));
    }

    #[test]
    fn times_that_der_forbids_are_refused() {
        let wrong = "20261122162923 20261122162923.Z 20261122162923.10Z 20261122162923,5Z 202611221629Z 20261322162923Z \
                     20230229000000Z 20261122162923+0100 +0261122162923Z 20261122162923.5.5Z 2026112216292éZ";
        for text in wrong.split(' ') {
            assert_eq!(read(text), None, "{text}");
        }
        assert_eq!(time(&Any::new(Tag::UtcTime, &b"20261122162923Z"[..]).unwrap()), None);
    }

    #[test]
    fn integers_keep_their_sign() {
        let cases: [(&[u8], &str); 6] = [
            (&[0], "0"),
            (&[0x0a, 0xbc], "abc"),
            (&[0x00, 0xff], "ff"),
            (&[0xff], "-1"),
            (&[0x80], "-80"),
            (&[0xff, 0x00], "-100"),
        ];
        for (bytes, text) in cases {
            assert_eq!(hexadecimal(&Int::new(bytes).unwrap()), text);
        }
    }

    #[test]
    fn words_of_strangers_cannot_steer_a_terminal() {
        assert_eq!(clean("a\u{1b}[2Jb\nc\u{9b}"), "a\u{fffd}[2Jb\u{fffd}c\u{fffd}");
    }
}
