//! The crate and OpenSSL's authority understand each other. Left out where there is no OpenSSL.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "a test that is left out says so")]

mod common;

use common::DIGEST;
use sombrero_timestamp::{Token, TokenError, TrustAnchors, request};
use std::path::Path;
use std::process::{Command, Output};

const SETTINGS: &str = include_str!("authority.cnf");

/// A folder with a fresh root and authority.
struct Authority(tempfile::TempDir);

impl Authority {
    /// `None` where the command is missing, or another program of that name.
    fn new() -> Option<Self> {
        let version = Command::new("openssl").arg("version").output().ok()?;
        if !version.stdout.starts_with(b"OpenSSL 3") {
            return None;
        }
        let authority = Self(tempfile::tempdir().unwrap());
        authority.write("settings", SETTINGS.as_bytes());
        authority.write("serial", b"01\n");
        for (name, kind) in [("root", "P-384"), ("tsa", "P-256")] {
            let curve = format!("ec_paramgen_curve:{kind}");
            authority.run(&format!("genpkey -quiet -algorithm EC -pkeyopt {curve} -out {name}.key"));
        }
        authority.run("req -new -x509 -config settings -extensions root -key root.key -days 2 -subj /CN=root -out root.pem");
        authority.run("req -new -config settings -key tsa.key -subj /CN=authority -out tsa.csr");
        authority.run("x509 -req -in tsa.csr -CA root.pem -CAkey root.key -CAcreateserial -days 2 -extfile settings -extensions authority -out tsa.pem");
        Some(authority)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path().join(name), bytes).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path().join(name)).unwrap()
    }

    fn output(&self, arguments: &str) -> Output {
        Command::new("openssl").args(arguments.split(' ')).current_dir(self.path()).output().unwrap()
    }

    fn run(&self, arguments: &str) -> String {
        let output = self.output(arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    fn anchors(&self) -> TrustAnchors {
        TrustAnchors::from_pem(&self.read("root.pem")).unwrap()
    }
}

#[test]
fn openssl_reads_stamps_and_agrees() {
    let Some(authority) = Authority::new() else {
        eprintln!("left out: there is no OpenSSL 3 on the path");
        return;
    };
    for nonce in [None, Some(0), Some(0x0123_4567_89ab_cdef), Some(u64::MAX)] {
        authority.write("request.tsq", &request(&DIGEST, nonce));
        let text = authority.run("ts -query -in request.tsq -text");
        // OpenSSL writes hex in whole bytes, except for zero.
        let shown =
            nonce.map_or("unspecified".into(), |n| if n == 0 { "0x0".into() } else { format!("0x{n:016X}") });
        for line in ["Version: 1", "sha256", "Certificate required: yes", &format!("Nonce: {shown}")] {
            assert!(text.contains(line), "{line}: {text}");
        }

        authority.run("ts -reply -config settings -queryfile request.tsq -out reply.tsr");
        let token = Token::from_der(&authority.read("reply.tsr")).unwrap();
        let verified = token.verify(&DIGEST, &authority.anchors()).unwrap();
        let anchor = verified.anchor.unwrap();
        assert_eq!((verified.trusted, anchor.subject.as_str()), (true, "CN=root"));
        let shown = authority.run("x509 -in root.pem -noout -fingerprint -sha256");
        let sha256: Vec<String> = anchor.sha256.iter().map(|byte| format!("{byte:02X}")).collect();
        assert_eq!(shown.trim().split_once('=').unwrap().1, sha256.join(":"));
        assert_eq!(token.policy(), "1.3.6.1.4.1.99999.2");
        assert_eq!(nonce.map_or(Ok(()), |n| token.check_nonce(n)), Ok(()));

        authority.write("token.der", token.to_der());
        authority.run("ts -verify -queryfile request.tsq -in reply.tsr -CAfile root.pem");
        authority.run("ts -verify -queryfile request.tsq -in token.der -token_in -CAfile root.pem");
    }
}

#[test]
fn openssl_refuses_what_is_refused_here() {
    let Some(authority) = Authority::new() else {
        eprintln!("left out: there is no OpenSSL 3 on the path");
        return;
    };
    authority.write("request.tsq", &request(&DIGEST, None));
    authority.write("other.tsq", &request(&[1; 32], None));
    authority.run("ts -reply -config settings -queryfile request.tsq -out reply.tsr");
    assert!(
        !authority.output("ts -verify -queryfile other.tsq -in reply.tsr -CAfile root.pem").status.success()
    );
    let token = Token::from_der(&authority.read("reply.tsr")).unwrap();
    assert!(matches!(token.verify(&[1; 32], &authority.anchors()), Err(TokenError::Digest { .. })));

    let mut changed = token.to_der().to_vec();
    *changed.last_mut().unwrap() ^= 1;
    authority.write("changed.der", &changed);
    let verify = "ts -verify -queryfile request.tsq -in changed.der -token_in -CAfile root.pem";
    assert!(!authority.output(verify).status.success());
    let changed = Token::from_der(&changed).unwrap();
    assert!(matches!(changed.verify(&DIGEST, &authority.anchors()), Err(TokenError::Signature { .. })));
}
