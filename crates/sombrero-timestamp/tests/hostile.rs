//! No bytes make the reader panic, and no change of a good token makes it say something else.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{DIGEST, anchors, data, token};
use proptest::prelude::*;
use ring::digest::{SHA256, digest};
use rustls_pki_types::CertificateDer;
use rustls_pki_types::pem::PemObject;
use sombrero_timestamp::{Token, TokenError, TrustAnchors, Verified};
use std::ops::Range;

const HIERARCHIES: [&str; 2] = ["rsa", "ec"];
const OTHER: [u8; 32] = [0x55; 32];

fn place(part: &[u8], whole: &[u8]) -> Range<usize> {
    let start = whole.windows(part.len()).position(|window| window == part).unwrap();
    start..start + part.len()
}

fn replace(whole: &[u8], part: &[u8], by: &[u8]) -> Vec<u8> {
    let mut changed = whole.to_vec();
    changed[place(part, whole)].copy_from_slice(by);
    changed
}

/// The contents of a token of these: as they are signed.
fn content(der: &[u8]) -> &[u8] {
    // SEQUENCE { INTEGER 1, OBJECT IDENTIFIER 1.3.6.1.4.1.99999.1, with a header of three bytes.
    let start = place(b"\x02\x01\x01\x06\x09\x2b\x06\x01\x04\x01\x86\x8d\x1f\x01", der).start - 3;
    &der[start..start + 3 + usize::from(der[start + 2])]
}

fn verified(der: &[u8], anchors: &TrustAnchors) -> Option<(Token, Verified)> {
    let token = Token::from_der(der).ok()?;
    let verified = token.verify(&DIGEST, anchors).ok()?;
    Some((token, verified))
}

/// Everything that a token says.
fn words(token: &Token) -> impl PartialEq + std::fmt::Debug {
    let owned = (token.time().to_owned(), token.serial().to_owned(), token.policy().to_owned());
    (owned, token.signer().to_owned(), token.nonce().map(str::to_owned), token.accuracy(), *token.digest())
}

/// What no signature covers: the version and the list of hashes, which come before the contents; certificates that the
/// chain does not need, such as the root; in front of the signed attributes and the signature, the version again and
/// the empty parameters of two algorithms.
fn is_free(at: usize, der: &[u8], root: &Range<usize>) -> bool {
    let null = |at: usize| der[at..].starts_with(&[0x05, 0x00]);
    let signer = root.end + 4;
    at < place(content(der), der).start
        || root.contains(&at)
        || (signer..signer + 8).contains(&at)
        || (at > signer && null(at))
}

#[test]
fn no_bit_that_matters_can_be_changed() {
    for hierarchy in HIERARCHIES {
        let pem = format!("{hierarchy}-root.pem");
        let (good, anchors) = (token(&format!("{hierarchy}.tsr")), anchors(&pem));
        let (der, root) = (good.to_der(), CertificateDer::from_pem_slice(&data(&pem)).unwrap());
        let (root, original) = (place(&root, der), good.verify(&DIGEST, &anchors).unwrap());
        let mut covered = 0;
        for (at, bit) in (0..der.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let mut changed = der.to_vec();
            changed[at] ^= 1 << bit;
            match verified(&changed, &anchors) {
                None => covered += 1,
                Some((token, result)) => {
                    assert!(is_free(at, der, &root), "{hierarchy}: byte {at}, bit {bit}");
                    assert_eq!((words(&token), result), (words(&good), original.clone()));
                }
            }
        }
        assert!(covered > 8 * (der.len() - root.len() - 60), "{hierarchy}: {covered}");
    }
}

#[test]
fn other_contents_need_another_signature() {
    let (good, anchors) = (token("rsa.tsr"), anchors("rsa-root.pem"));
    let changed = replace(good.to_der(), &DIGEST, &OTHER);
    let error = Token::from_der(&changed).unwrap().verify(&OTHER, &anchors).unwrap_err();
    assert!(matches!(error, TokenError::Attribute { attribute: "message-digest", .. }), "{error}");

    let stated = digest(&SHA256, content(good.to_der()));
    let forged = replace(&changed, stated.as_ref(), digest(&SHA256, content(&changed)).as_ref());
    let forged = Token::from_der(&forged).unwrap();
    for anchors in [anchors, TrustAnchors::none()] {
        let error = forged.verify(&OTHER, &anchors).unwrap_err();
        assert!(matches!(error, TokenError::Signature { .. }), "{error}");
    }
}

#[test]
fn another_certificate_cannot_take_the_place_of_the_signers() {
    // The same issuer, serial number and key, but another name: only the attribute that names the certificate tells.
    // It does so by SHA-256, SHA-512 and SHA-1.
    let (new, old) = ("signing-certificate-v2", "signing-certificate");
    for (name, expected) in [("rsa.tsr", new), ("rsa-sha384.tsr", new), ("rsa-sha512.tsr", old)] {
        let good = token(name);
        let mut changed = good.to_der().to_vec();
        changed[place(b"rsa authority0\x82", good.to_der()).start] = b'R';
        let changed = Token::from_der(&changed).unwrap();
        assert_eq!(changed.signer(), "CN=Rsa authority,O=Sombrero test");
        let error = changed.verify(&DIGEST, &TrustAnchors::none()).unwrap_err();
        assert!(matches!(error, TokenError::Attribute { attribute, .. } if attribute == expected), "{error}");
    }
}

#[test]
fn parts_of_files_are_no_tokens() {
    for name in ["rsa.tsr", "ec.tsr", "rejected.tsr", "pss.der"] {
        let bytes = data(name);
        for end in 0..bytes.len() {
            assert!(
                matches!(Token::from_der(&bytes[..end]), Err(TokenError::Syntax { .. })),
                "{name}: {end}"
            );
        }
        assert!(matches!(Token::from_der(&[&bytes[..], &[0]].concat()), Err(TokenError::Syntax { .. })));
    }
}

/// A file with bytes set, cut out or put in.
fn mutant(bytes: &[u8], changes: &[(prop::sample::Index, Vec<u8>, u8)]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (at, new, removed) in changes {
        let at = at.index(bytes.len() + 1);
        let end = bytes.len().min(at + usize::from(*removed));
        bytes.splice(at..end, new.iter().copied());
    }
    bytes
}

fn changes() -> impl Strategy<Value = Vec<(prop::sample::Index, Vec<u8>, u8)>> {
    // Mostly as many bytes in as out, or else every length around the change would be wrong.
    let same = prop::collection::vec(any::<u8>(), 1..4).prop_map(|new| (new.clone(), new.len() as u8));
    let change = prop_oneof![4 => same, 1 => (prop::collection::vec(any::<u8>(), 0..8), 0..8u8)];
    prop::collection::vec(
        (any::<prop::sample::Index>(), change).prop_map(|(at, (new, out))| (at, new, out)),
        1..4,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn any_bytes_are_a_token_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Token::from_der(&bytes).is_err());
    }

    #[test]
    fn any_bytes_are_anchors_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let framed = [b"-----BEGIN CERTIFICATE-----\n", &bytes[..], b"\n-----END CERTIFICATE-----\n"].concat();
        prop_assert!(TrustAnchors::from_pem(&framed).is_err());
    }

    #[test]
    fn changed_anchors_are_anchors_or_an_error(changes in changes()) {
        // No panic, here or in a verification.
        if let Ok(anchors) = TrustAnchors::from_pem(&mutant(&data("rsa-root.pem"), &changes)) {
            let _ = token("rsa.tsr").verify(&DIGEST, &anchors);
        }
    }

    #[test]
    fn changed_tokens_say_the_same_or_nothing(which in 0..8usize, changes in changes()) {
        let names = ["rsa.tsr", "rsa-sha512.tsr", "ec.tsr", "p384.tsr", "pss.der", "key-identifier.der", "rejected.tsr", "leaf.der"];
        let bytes = data(names[which]);
        let all = TrustAnchors::from_pem(&[data("rsa-root.pem"), data("ec-root.pem")].concat()).unwrap();
        let changed = mutant(&bytes, &changes);
        if let Some((token, result)) = verified(&changed, &all) {
            let (good, original) = verified(&bytes, &all).unwrap();
            prop_assert_eq!(words(&token), words(&good));
            prop_assert_eq!(result, original);
        }
        if let Some((_, result)) = verified(&changed, &TrustAnchors::none()) {
            prop_assert!(!result.trusted);
        }
    }
}
