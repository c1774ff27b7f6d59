//! Tokens by OpenSSL, good and bad. `data/README.md` says what each is.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use common::{DIGEST, anchors, data, token, token_out};
use sha2::{Digest, Sha256};
use sombrero_timestamp::{Anchor, AnchorError, Token, TokenError, TrustAnchors};
use std::time::Duration;

const GOOD: [(&str, &str); 7] = [
    ("rsa.tsr", "rsa"),
    ("rsa-sha384.tsr", "rsa"),
    ("rsa-sha512.tsr", "rsa"),
    ("ec.tsr", "ec"),
    ("p384.tsr", "ec"),
    ("pss.der", "rsa"),
    ("key-identifier.der", "rsa"),
];

/// What a verification with the RSA root says against a token that can be read.
fn refusal(name: &str) -> TokenError {
    token(name).verify(&DIGEST, &anchors("rsa-root.pem")).unwrap_err()
}

#[test]
fn good_tokens_are_trusted() {
    for (name, hierarchy) in GOOD {
        let token = token(name);
        let verified = token.verify(&DIGEST, &anchors(&format!("{hierarchy}-root.pem"))).unwrap();
        assert!(verified.trusted, "{name}");
        let anchor = verified.anchor.unwrap();
        assert_eq!(anchor.subject, format!("CN={hierarchy} root,O=Sombrero test"), "{name}");
        assert_eq!(anchor.sha256, fingerprint(&format!("{hierarchy}-root.pem")), "{name}");
        assert_eq!((verified.time.as_str(), verified.signer.as_str()), (token.time(), token.signer()));
    }
}

/// SHA-256 of a certificate, found without the code under test.
fn fingerprint(name: &str) -> [u8; 32] {
    let pem = String::from_utf8(data(name)).unwrap();
    let base64: String = pem.lines().filter(|line| !line.starts_with('-')).collect();
    Sha256::digest(BASE64_STANDARD.decode(base64).unwrap()).into()
}

#[test]
fn an_anchor_is_told_from_one_that_has_its_name() {
    let [real, impostor] = ["rsa-root.pem", "impostor-root.pem"].map(fingerprint);
    assert_ne!(real, impostor);
    let both = TrustAnchors::from_pem(&[data("impostor-root.pem"), data("rsa-root.pem")].concat()).unwrap();
    let anchor = token("rsa.tsr").verify(&DIGEST, &both).unwrap().anchor.unwrap();
    assert_eq!(anchor, Anchor { subject: "CN=rsa root,O=Sombrero test".into(), sha256: real });
}

#[test]
fn what_a_token_says_can_be_read() {
    let token = token("rsa.tsr");
    assert_eq!(token.digest(), &DIGEST);
    assert_eq!(token.signer(), "CN=rsa authority,O=Sombrero test");
    assert_eq!(token.policy(), "1.3.6.1.4.1.99999.1");
    assert_eq!(token.accuracy(), Some(Duration::from_micros(1_500_100)));
    assert_eq!(token.serial(), "abd");
    assert!(token.time().starts_with("20") && token.time().len() == "2026-11-22T16:29:23Z".len());
    let nonce = u64::from_str_radix(token.nonce().unwrap(), 16).unwrap();
    assert_eq!(token.check_nonce(nonce), Ok(()));
    assert!(matches!(token.check_nonce(nonce ^ 1), Err(TokenError::Nonce { .. })));
}

#[test]
fn fractions_of_a_second_are_kept() {
    let token = token("ec.tsr");
    let (_, fraction) = token.time().split_once('.').unwrap();
    assert!((2..=7).contains(&fraction.len()) && fraction.ends_with('Z'), "{}", token.time());
}

#[test]
fn a_reply_and_its_token_are_the_same() {
    let reply = token("rsa.tsr");
    let bare = Token::from_der(reply.to_der()).unwrap();
    assert_eq!(bare, reply);
    assert_eq!(bare.to_der(), token_out(&data("rsa.tsr")));
}

#[test]
fn without_anchors_nobody_is_trusted() {
    for name in GOOD.map(|(name, _)| name).into_iter().chain(["self-signed.tsr", "expired.der", "leaf.der"]) {
        let verified = token(name).verify(&DIGEST, &TrustAnchors::none()).unwrap();
        assert!(!verified.trusted && verified.anchor.is_none(), "{name}");
    }
}

#[test]
fn without_anchors_what_is_not_whole_is_refused() {
    let none = TrustAnchors::none();
    for name in ["unnamed-certificate.der", "no-attributes.der", "nousage.der", "other-digest.tsr"] {
        assert!(token(name).verify(&DIGEST, &none).is_err(), "{name}");
    }
}

#[test]
fn other_anchors_do_not_vouch() {
    let token = token("rsa.tsr");
    for other in ["ec-root.pem", "self.pem"] {
        let error = token.verify(&DIGEST, &anchors(other)).unwrap_err();
        assert!(matches!(&error, TokenError::Untrusted { signer } if signer == token.signer()), "{error}");
    }
    let error = token.verify(&DIGEST, &anchors("impostor-root.pem")).unwrap_err();
    assert!(matches!(&error, TokenError::Chain { detail, .. } if detail.contains("not signed")), "{error}");
}

#[test]
fn one_of_several_anchors_is_enough() {
    let bundle = [data("ec-root.pem"), data("impostor-root.pem"), data("rsa-root.pem")].concat();
    let all = TrustAnchors::from_pem(&bundle).unwrap();
    assert_eq!(all.len(), 3);
    for (name, _) in GOOD {
        assert!(token(name).verify(&DIGEST, &all).unwrap().trusted, "{name}");
    }
}

#[test]
fn a_rejection_is_told_in_the_words_of_the_authority() {
    let error = Token::from_der(&data("rejected.tsr")).unwrap_err();
    let TokenError::Refused { status, words } = &error else { panic!("{error}") };
    assert_eq!(status, "rejection, badAlg");
    assert!(words.contains("not supported"), "{words}");
    assert!(error.to_string().contains(words.as_str()));
}

#[test]
fn a_token_for_another_digest_is_refused() {
    let error = refusal("other-digest.tsr");
    assert!(matches!(error, TokenError::Digest { .. }), "{error}");
    let error = token("rsa.tsr").verify(&[0; 32], &anchors("rsa-root.pem")).unwrap_err();
    assert!(error.to_string().contains(&"00".repeat(32)), "{error}");
}

#[test]
fn what_is_no_token_for_a_sha256_cannot_be_read() {
    let error = |name: &str| Token::from_der(&data(name)).unwrap_err();
    for (name, algorithm) in [
        ("other-hash.tsr", "SHA-512 (2.16.840.1.101.3.4.2.3)"),
        ("sha1-digest.tsr", "SHA-1 (1.3.14.3.2.26)"),
        ("md5-digest.tsr", "MD5 (1.2.840.113549.2.5)"),
    ] {
        assert_eq!(error(name), TokenError::Hash { algorithm: algorithm.into() });
    }
    assert_eq!(error("no-certificate.tsr"), TokenError::NoCertificate);
    assert!(matches!(error("two-signatures.der"), TokenError::Syntax { part: "signature", .. }));
    assert!(matches!(error("not-a-stamp.der"), TokenError::Syntax { part: "signed data", .. }));
    assert!(matches!(error("rsa-root.pem"), TokenError::Syntax { .. }));
}

#[test]
fn a_self_signed_signer_is_not_trusted() {
    let error = refusal("self-signed.tsr");
    assert_eq!(error, TokenError::Untrusted { signer: "CN=nobody,O=Sombrero test".into() });
}

#[test]
fn certificates_for_something_else_are_refused() {
    for (name, what) in
        [("nousage.der", "does not have"), ("uncritical.der", "critical"), ("twousages.der", "alone")]
    {
        let error = refusal(name);
        assert!(
            matches!(error, TokenError::Usage { problem, .. } if problem.contains(what)),
            "{name}: {error}"
        );
    }
}

#[test]
fn certificates_that_do_not_make_a_chain_are_refused() {
    for (name, what) in [
        ("leaf.der", "may not issue"),
        ("expired.der", "had expired"),
        ("heir.der", "had expired"),
        ("weak.der", "SHA-1"),
    ] {
        let error = refusal(name);
        assert!(
            matches!(&error, TokenError::Chain { detail, .. } if detail.contains(what)),
            "{name}: {error}"
        );
    }
}

#[test]
fn signed_attributes_must_be_there() {
    let attribute = |name| match refusal(name) {
        TokenError::Attribute { attribute, .. } => attribute,
        other => panic!("{name}: {other}"),
    };
    assert_eq!(attribute("unnamed-certificate.der"), "signing-certificate-v2");
    assert_eq!(attribute("no-attributes.der"), "content-type");
}

#[test]
fn bundles_without_usable_certificates_are_refused() {
    let error = |pem: &[u8]| TrustAnchors::from_pem(pem).unwrap_err();
    assert_eq!(error(b""), AnchorError::Empty);
    assert_eq!(error(b"a text"), AnchorError::Empty);
    assert_eq!(error(&data("rsa.tsr")), AnchorError::Empty);
    let hollow = b"-----BEGIN CERTIFICATE-----\nMAA=\n-----END CERTIFICATE-----\n";
    assert!(matches!(error(hollow), AnchorError::Certificate { number: 1, .. }));
    let second = [&data("rsa-root.pem")[..], b"-----BEGIN CERTIFICATE-----\n!\n-----END CERTIFICATE-----\n"];
    assert!(matches!(error(&second.concat()), AnchorError::Pem { number: 2, .. }));
}

#[test]
fn a_critical_extension_must_be_understood() {
    assert_eq!(refusal("extension.der"), TokenError::Extension { oid: "1.3.6.1.4.1.99999.7".into() });
    let token = token("extension.der");
    assert_eq!((token.serial(), token.nonce(), token.accuracy()), ("-5", None, None));
    assert_eq!(token.time(), "2030-01-01T00:00:00Z");
    assert_eq!(token.check_nonce(0), Err(TokenError::Nonce { expected: "0".into(), found: "absent".into() }));
}

#[test]
fn a_signature_with_sha1_is_refused() {
    let error = refusal("rsa-sha1.tsr");
    assert!(
        matches!(&error, TokenError::Algorithm { algorithm, .. } if algorithm.starts_with("SHA-1 ")),
        "{error}"
    );
}

#[test]
fn an_algorithm_that_is_not_supported_is_named() {
    let error = refusal("ec-sha512.tsr");
    // ecdsa-with-SHA512 (RFC 5758, section 3.2).
    assert!(
        matches!(&error, TokenError::Algorithm { algorithm, .. } if algorithm.starts_with("1.2.840.10045.4.3.4 ")),
        "{error}"
    );
}
