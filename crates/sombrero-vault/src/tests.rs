//! What is kept comes back, to whom it shall, and nothing of it shows.

use crate::{IdentityText, Lock, Opened, SecretString, Vault, VaultError};
use age::secrecy::ExposeSecret;
use age::x25519;
use proptest::prelude::*;
use sombrero_io::Limits;
use std::fs;
use std::path::{Path, PathBuf};

const DIGEST: [u8; 32] = [0xab; 32];

/// A key pair of somebody's own, which costs no scrypt.
struct Owner(x25519::Identity);

impl Owner {
    fn new() -> Self {
        Self(x25519::Identity::generate())
    }

    fn lock(&self) -> Lock {
        Lock::Recipients(vec![self.0.to_public().to_string()])
    }

    fn text(&self) -> IdentityText {
        let secret = self.0.to_string();
        let text = format!("# a comment\r\n\n  {}\r\n", secret.expose_secret());
        IdentityText::new("identity.txt", text.into())
    }

    fn opened(&self, vault: &Vault) -> Opened {
        vault.unlock(&self.text(), None).unwrap()
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found
}

#[test]
fn a_passphrase_opens_what_was_kept_without_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("models/vault");
    assert!(!Vault::is_at(&folder));
    let secret = |text: &str| SecretString::from(text.to_owned());
    assert!(matches!(Vault::create(&folder, &Lock::Passphrase(secret(""))), Err(VaultError::NoPassphrase)));
    assert!(!folder.exists());
    Vault::create(&folder, &Lock::Passphrase(secret("right"))).unwrap();
    let vault = Vault::open(&folder).unwrap();
    assert!(vault.keep_original(&DIGEST, &[("vase.obj", b"v 0 0 0\n")]).unwrap());
    let identity = vault.identity().unwrap();
    assert!(identity.is_encrypted());
    let wrong = vault.unlock(&identity, Some(&secret("wrong"))).unwrap_err();
    assert!(matches!(wrong, VaultError::Passphrase { .. }), "{wrong}");
    assert!(matches!(vault.unlock(&identity, None).unwrap_err(), VaultError::NoPassphrase));
    let opened = vault.unlock(&identity, Some(&secret("right"))).unwrap();
    assert_eq!(opened.original(&DIGEST, Limits::default()).unwrap()[0].bytes, b"v 0 0 0\n");

    // Without the secret half nothing opens, and it is said which one is missing.
    let half = files(&folder)
        .into_iter()
        .find(|path| path.ends_with(format!("{}.identity.age", vault.recipients())));
    fs::remove_file(half.unwrap()).unwrap();
    let lost = vault.identity().unwrap_err();
    assert!(matches!(lost, VaultError::NoIdentity { .. }) && lost.to_string().contains(&vault.recipients()));
}

#[test]
fn an_identity_opens_what_was_encrypted_to_it_and_no_other_does() {
    let folder = tempfile::tempdir().unwrap();
    let (owner, other) = (Owner::new(), Owner::new());
    let vault = Vault::create(folder.path(), &owner.lock()).unwrap();
    assert!(matches!(vault.identity(), Err(VaultError::NoIdentity { .. })));
    assert!(matches!(vault.unlock(&other.text(), None), Err(VaultError::OtherIdentity { .. })));
    for text in ["", "# only a comment\n", "AGE-SECRET-KEY-1\n", "age-encryption.org/v1\n-> X\n", "\u{fffd}"]
    {
        let text = IdentityText::new("identity.txt", text.into());
        let error = vault.unlock(&text, Some(&SecretString::from("x"))).unwrap_err();
        assert!(matches!(error, VaultError::Identity { .. }), "{error}");
    }
    let Lock::Recipients(own) = owner.lock() else { return };
    vault.check_recipients(&own).unwrap();
    let Lock::Recipients(others) = other.lock() else { return };
    assert!(matches!(vault.check_recipients(&others), Err(VaultError::OtherLock { .. })));
    let none = vec!["age1".to_owned()];
    assert!(matches!(vault.check_recipients(&none), Err(VaultError::Recipient { .. })));

    // Whoever could write put another public key in the place of the owner's.
    fs::write(folder.path().join("recipients"), format!("{}\n", other.0.to_public())).unwrap();
    let changed = Vault::open(folder.path()).unwrap();
    assert!(matches!(changed.unlock(&owner.text(), None), Err(VaultError::OtherIdentity { .. })));
    fs::write(folder.path().join("recipients"), "# nobody\n").unwrap();
    assert!(matches!(Vault::open(folder.path()), Err(VaultError::NoRecipients { .. })));
}

#[test]
fn keys_are_kept_once_and_beside_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let owner = Owner::new();
    let vault = Vault::create(folder.path(), &owner.lock()).unwrap();
    assert!(vault.keys(&DIGEST).unwrap().is_empty());
    for (key, is_new) in [("one", true), ("two", true), ("one", false)] {
        assert_eq!(vault.keep_key(&DIGEST, key.as_bytes()).unwrap(), is_new);
    }
    assert!(vault.keep_key(&[1; 32], b"of another original").unwrap());
    let opened = owner.opened(&vault);
    let keys = opened.keys(&DIGEST, Limits::default()).unwrap();
    let mut texts: Vec<&[u8]> = keys.iter().map(|(_, key)| key.as_slice()).collect();
    texts.sort_unstable();
    assert_eq!(texts, [b"one", b"two"]);

    assert!(matches!(opened.original(&DIGEST, Limits::default()), Err(VaultError::NotKept { .. })));
    vault.keep_original(&DIGEST, &[("a", b"12345")]).unwrap();
    let small = Limits::default().with_max_bytes(4);
    assert!(opened.original(&DIGEST, small).is_err());
    assert!(vault.has_original(&DIGEST));
    vault.forget(&DIGEST).unwrap();
    vault.forget(&DIGEST).unwrap();
    assert!(!vault.has_original(&DIGEST) && vault.keys(&DIGEST).unwrap().is_empty());
    assert_eq!(vault.keys(&[1; 32]).unwrap().len(), 1);
}

#[test]
fn two_runs_that_begin_at_once_make_one_vault() {
    let folder = tempfile::tempdir().unwrap();
    let owners = [Owner::new(), Owner::new(), Owner::new()];
    let made = std::thread::scope(|scope| {
        let runs = owners.each_ref().map(|owner| scope.spawn(|| Vault::create(folder.path(), &owner.lock())));
        runs.map(|run| run.join().unwrap().unwrap().recipients())
    });
    assert!(made.iter().all(|recipients| *recipients == made[0]), "{made:?}");
}

#[cfg(unix)]
#[test]
fn only_the_owner_may_look() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("vault");
    let vault = Vault::create(&folder, &Owner::new().lock()).unwrap();
    vault.keep_original(&DIGEST, &[("a", b"b")]).unwrap();
    vault.keep_key(&DIGEST, b"c").unwrap();
    for path in files(&folder).iter().flat_map(|file| [file.as_path(), file.parent().unwrap()]) {
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o077, 0, "{}", path.display());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn what_is_kept_comes_back_and_shows_nowhere(
        original in prop::collection::vec(any::<u8>(), 64..3000),
        beside in prop::collection::vec(any::<u8>(), 64..200),
        key in "[a-z ]{64,200}",
    ) {
        let folder = tempfile::tempdir().unwrap();
        let owner = Owner::new();
        let vault = Vault::create(folder.path(), &owner.lock()).unwrap();
        vault.keep_original(&DIGEST, &[("the vase.obj", &original), ("b/the side.bin", &beside)]).unwrap();
        vault.keep_key(&DIGEST, key.as_bytes()).unwrap();
        let opened = owner.opened(&vault);
        let kept = opened.original(&DIGEST, Limits::default()).unwrap();
        prop_assert!(kept[0].bytes == original && kept[0].name == "the vase.obj" && kept.len() == 2);
        prop_assert!(kept[1].bytes == beside && kept[1].name == "b/the side.bin");
        prop_assert_eq!(&opened.keys(&DIGEST, Limits::default()).unwrap()[0].1, key.as_bytes());
        let known = [&original[..16], &beside[..16], &key.as_bytes()[..16], b"the vase", b"the side"];
        for file in files(folder.path()) {
            let bytes = fs::read(&file).unwrap();
            for known in known {
                prop_assert!(!bytes.windows(known.len()).any(|window| window == known), "{}", file.display());
            }
        }
    }

    #[test]
    fn what_was_damaged_is_named(at in 0.0..1.0, bit in 0..8_u32, cut in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let owner = Owner::new();
        let vault = Vault::create(folder.path(), &owner.lock()).unwrap();
        vault.keep_original(&DIGEST, &[("a.obj", &[7; 500])]).unwrap();
        let path = vault.original_path(&DIGEST);
        let mut bytes = fs::read(&path).unwrap();
        let place = (at * bytes.len() as f64) as usize;
        if cut { bytes.truncate(place) } else { bytes[place] ^= 1 << bit }
        fs::write(&path, bytes).unwrap();
        let error = owner.opened(&vault).original(&DIGEST, Limits::default()).unwrap_err();
        prop_assert!(matches!(error, VaultError::Damaged { .. }), "{}", error);
        prop_assert!(error.to_string().starts_with(&path.display().to_string()));
    }
}
