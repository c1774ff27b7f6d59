//! Files that belong together as one compressed archive: tar, then gzip, so that `age -d | tar xz` gives them back where
//! this program is not at hand.

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use std::io::{self, Read, Write};
use tar::{Archive, Builder, EntryType, Header};

/// A file that is kept: its name and its content.
#[derive(Clone, PartialEq, Eq)]
pub struct KeptFile {
    /// What it is called: of the first one its own name, of others the name by which the first one refers to them.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl std::fmt::Debug for KeptFile {
    /// Without the content, which is secret.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "KeptFile({:?}, {} bytes)", self.name, self.bytes.len())
    }
}

/// Writes the archive of files, given as name and content.
pub(crate) fn pack(files: &[(&str, &[u8])], to: &mut dyn Write) -> io::Result<()> {
    let mut archive = Builder::new(GzEncoder::new(to, Compression::default()));
    for (name, bytes) in files {
        let mut header = Header::new_gnu();
        header.set_entry_type(EntryType::Regular);
        header.set_mode(0o600);
        header.set_size(bytes.len() as u64);
        archive.append_data(&mut header, name, *bytes)?;
    }
    archive.into_inner()?.finish().map(drop)
}

/// Why there are no files.
pub(crate) enum UnpackError {
    TooLarge,
    Io(io::Error),
}

impl From<io::Error> for UnpackError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// The files of an archive, `most` bytes in all.
pub(crate) fn unpack(archive: impl Read, most: u64) -> Result<Vec<KeptFile>, UnpackError> {
    let mut left = most;
    let mut files = Vec::new();
    let mut archive = Archive::new(GzDecoder::new(archive));
    for entry in archive.entries()? {
        let entry = entry?;
        let name = String::from_utf8(entry.path_bytes().into_owned()).map_err(io::Error::other)?;
        let mut bytes = Vec::new();
        // One byte over the limit tells.
        entry.take(left.saturating_add(1)).read_to_end(&mut bytes)?;
        left = left.checked_sub(bytes.len() as u64).ok_or(UnpackError::TooLarge)?;
        files.push(KeptFile { name, bytes });
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_packed_comes_back(
            files in prop::collection::vec(("[a-zżø花 ./%]{0,120}[a-z]", prop::collection::vec(any::<u8>(), 0..300)), 1..5),
        ) {
            let plain = |name: &str| name.split('/').all(|part| !part.is_empty() && part != "." && part != "..");
            prop_assume!(files.iter().all(|(name, _)| plain(name)));
            let given: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (&**name, &**bytes)).collect();
            let mut archive = Vec::new();
            pack(&given, &mut archive).unwrap();
            let all: u64 = files.iter().map(|(_, bytes)| bytes.len() as u64).sum();
            let unpacked = unpack(&archive[..], all).ok().unwrap();
            prop_assert!(unpacked.iter().map(|file| (&*file.name, &*file.bytes)).eq(given));
            if all > 0 {
                prop_assert!(matches!(unpack(&archive[..], all - 1), Err(UnpackError::TooLarge)));
            }
        }

        #[test]
        fn any_bytes_are_an_archive_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
            packed.write_all(&bytes).unwrap();
            for archive in [bytes, packed.finish().unwrap()] {
                if let Ok(files) = unpack(&archive[..], 500) {
                    prop_assert!(files.iter().map(|file| file.bytes.len()).sum::<usize>() <= 500);
                }
            }
        }
    }
}
