//! The prepared basis: the basis of one original and key, so that detection need not compute it anew.
//!
//! ```text
//! "sombrero prepared 1\n"
//! identity            SHA-256 of what the key says of original, basis and parameters
//! n, m                vertices and functions, 64 bits each
//! m records           centre (32 bits), split, height, direction (3), amplitude, entries of the column
//! rows                of all columns, 32 bits each, increasing in a column
//! values              of all columns, in the order of the rows
//! SHA-256             of everything above
//! ```
//!
//! Of functions that are vectors, "sombrero prepared vectors 1\n", identity, n, m, the entries of the m columns, rows, three
//! values a row, and the hash.
//!
//! All numbers are little endian, and where nothing is said have 64 bits. The hash at the end tells damage; it protects
//! from nobody. That the basis is the one that was marked with, the key's own hash of it tells.

use nalgebra::Vector3;
use nalgebra_sparse::CscMatrix;
use sha2::{Digest, Sha256};
use sombrero_basis::{Basis, Function};
use sombrero_mesh::VertexId;
use sombrero_watermark::Key;
use thiserror::Error;

/// What every version begins with.
const FAMILY: &[u8] = b"sombrero prepared ";
const MAGIC: &[u8] = b"sombrero prepared 1\n";
const VECTORS: &[u8] = b"sombrero prepared vectors 1\n";
/// Bytes of a function's record.
const RECORD: usize = 60;
/// Bytes of an entry: a row and a value.
const ENTRY: usize = 12;
/// The same where a value is a vector.
const VECTOR_ENTRY: usize = 28;

/// The reason why a file is no prepared basis that fits a key.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PreparedBasisError {
    /// It is something else.
    #[error("not a prepared file; make one with `sombrero prepare`")]
    Foreign,
    /// Another version of the format.
    #[error(
        "a prepared file of another version of this program; make it anew with `sombrero prepare --force`"
    )]
    Version,
    /// It is cut off, or bytes of it were changed.
    #[error("a damaged prepared file; make it anew with `sombrero prepare --force`")]
    Damaged,
    /// It belongs to another original or to another key.
    #[error(
        "a prepared file for another original or another key; make one for this key with `sombrero prepare`"
    )]
    Unrelated,
}

/// A basis that was stored: the one whose hash stands in the key.
///
/// That hash is all that vouches for it. For a key of one's own this is enough: nobody else can change what
/// [`Detector::detect`](crate::Detector::detect) says. A forger of a *key* can make a prepared basis to match, though,
/// with any functions they like: see [`Detector::confirm`](crate::Detector::confirm).
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedBasis(pub(crate) Basis);

impl PreparedBasis {
    /// Reads what [`Detector::prepared_basis`](crate::Detector::prepared_basis) made for this `key`. Any bytes are a basis or an
    /// error, and memory use stays within a small multiple of their number.
    ///
    /// # Errors
    /// [`PreparedBasisError`] when the file is damaged or belongs to something else.
    pub fn parse(file: &[u8], key: &Key) -> Result<Self, PreparedBasisError> {
        let family = file.starts_with(FAMILY);
        let vectors = file.starts_with(VECTORS);
        let magic = if vectors { VECTORS } else { MAGIC };
        if !file.starts_with(magic) {
            return Err(if family { PreparedBasisError::Version } else { PreparedBasisError::Foreign });
        }
        let (content, hash) = file.split_last_chunk::<32>().ok_or(PreparedBasisError::Damaged)?;
        if Sha256::digest(content).as_slice() != hash {
            return Err(PreparedBasisError::Damaged);
        }
        let mut rest = Bytes(content.get(magic.len()..).ok_or(PreparedBasisError::Damaged)?);
        if rest.array::<32>() != Some(identity(key)) {
            return Err(PreparedBasisError::Unrelated);
        }
        let basis =
            if vectors { vector_basis(rest) } else { basis(rest) }.ok_or(PreparedBasisError::Damaged)?;
        let fits = basis.functions().len() == key.watermark.len() && key.check_basis(&basis.digest()).is_ok();
        if fits { Ok(Self(basis)) } else { Err(PreparedBasisError::Unrelated) }
    }
}

/// The file for this basis and key.
pub(crate) fn write(basis: &Basis, key: &Key) -> Vec<u8> {
    if let Some(vectors) = basis.vectors() {
        return write_vectors(vectors, key);
    }
    let (functions, values) = (basis.functions(), basis.values());
    let size = MAGIC.len() + 2 * 32 + 2 * 8 + RECORD * functions.len() + ENTRY * values.nnz();
    let mut file = Vec::with_capacity(size);
    file.extend(MAGIC);
    file.extend(identity(key));
    file.extend((basis.vertex_count() as u64).to_le_bytes());
    file.extend((functions.len() as u64).to_le_bytes());
    for (function, column) in functions.iter().zip(values.col_iter()) {
        let Function { centre, split, height, direction, amplitude } = function;
        file.extend(centre.to_u32().to_le_bytes());
        file.extend((*split as u64).to_le_bytes());
        let numbers = [*height, direction.x, direction.y, direction.z, *amplitude];
        file.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
        file.extend((column.nnz() as u64).to_le_bytes());
    }
    // Vertices are counted in 32 bits everywhere.
    file.extend(values.row_indices().iter().flat_map(|&row| (row as u32).to_le_bytes()));
    file.extend(values.values().iter().flat_map(|value| value.to_le_bytes()));
    let hash = Sha256::digest(&file);
    file.extend(hash);
    file
}

fn write_vectors(vectors: &CscMatrix<Vector3<f64>>, key: &Key) -> Vec<u8> {
    let size = VECTORS.len() + 2 * 32 + 2 * 8 + 8 * vectors.ncols() + VECTOR_ENTRY * vectors.nnz();
    let mut file = Vec::with_capacity(size);
    file.extend(VECTORS);
    file.extend(identity(key));
    file.extend((vectors.nrows() as u64).to_le_bytes());
    file.extend((vectors.ncols() as u64).to_le_bytes());
    file.extend(vectors.col_iter().flat_map(|column| (column.nnz() as u64).to_le_bytes()));
    file.extend(vectors.row_indices().iter().flat_map(|&row| (row as u32).to_le_bytes()));
    file.extend(vectors.values().iter().flat_map(|d| [d.x, d.y, d.z]).flat_map(f64::to_le_bytes));
    let hash = Sha256::digest(&file);
    file.extend(hash);
    file
}

/// All that the basis follows from, and its hash.
fn identity(key: &Key) -> [u8; 32] {
    let options = key.parameters.basis;
    let parameters = format!("{} {} {}", options.coefficients, options.function, options.amplitudes);
    let mut hash = Sha256::new();
    hash.update(key.original_sha256);
    hash.update(key.basis_sha256);
    hash.update(parameters);
    hash.finalize().into()
}

/// What follows the identity; `None` when it does not fit together.
fn basis(mut rest: Bytes) -> Option<Basis> {
    let (vertices, m) = (rest.size()?, rest.size()?);
    let mut records = Bytes(rest.take(m.checked_mul(RECORD)?)?);
    let (mut functions, mut lengths) = (Vec::with_capacity(m), Vec::with_capacity(m));
    for _ in 0..m {
        functions.push(records.function()?);
        lengths.push(records.size()?);
    }
    // All that is left are entries, so their number need not be believed.
    let entries = rest.0.len() / ENTRY;
    let rows = Bytes(rest.take(entries * 4)?).numbers(|b| u32::from_le_bytes(b) as usize);
    let values = Bytes(rest.take(entries * 8)?).numbers(f64::from_le_bytes);
    let whole = rest.0.is_empty();
    Basis::from_parts(vertices, functions, &lengths, rows, values).ok().filter(|_| whole)
}

/// The same where functions are vectors.
fn vector_basis(mut rest: Bytes) -> Option<Basis> {
    let (vertices, m) = (rest.size()?, rest.size()?);
    let lengths = Bytes(rest.take(m.checked_mul(8)?)?).numbers(u64::from_le_bytes);
    let lengths: Vec<usize> = lengths.into_iter().map(usize::try_from).collect::<Result<_, _>>().ok()?;
    let entries = rest.0.len() / VECTOR_ENTRY;
    let rows = Bytes(rest.take(entries * 4)?).numbers(|b| u32::from_le_bytes(b) as usize);
    let numbers = Bytes(rest.take(entries * 24)?).numbers(f64::from_le_bytes);
    let vectors = numbers.as_chunks().0.iter().map(|&d: &[f64; 3]| Vector3::from(d)).collect();
    let whole = rest.0.is_empty();
    Basis::from_vectors(vertices, &lengths, rows, vectors).ok().filter(|_| whole)
}

/// Bytes that are still to be read.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    /// A number of things, in 64 bits.
    fn size(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.array()?)).ok()
    }

    fn float(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }

    fn function(&mut self) -> Option<Function> {
        Some(Function {
            centre: VertexId::new(u32::from_le_bytes(self.array()?) as usize),
            split: self.size()?,
            height: self.float()?,
            direction: [self.float()?, self.float()?, self.float()?].into(),
            amplitude: self.float()?,
        })
    }

    /// Everything, N bytes a number.
    fn numbers<const N: usize, T>(self, number: fn([u8; N]) -> T) -> Vec<T> {
        self.0.as_chunks().0.iter().map(|bytes| number(*bytes)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DetectError, DetectOptions, Detector, EmbedOptions, Method, embed};
    use nalgebra::Point3;
    use proptest::prelude::*;
    use sombrero_basis::BasisOptions;
    use sombrero_io::{Document, Format, encode};
    use sombrero_shapes as shapes;
    use sombrero_watermark::{Derivation, Mismatch, OriginalDigest, Parameters, Preset, Secret};
    use std::sync::LazyLock;

    static MADE: LazyLock<(Detector, Vec<u8>)> = LazyLock::new(|| made(1, Preset::Robust));

    fn made(secret: u8, preset: Preset) -> (Detector, Vec<u8>) {
        let file = encode(Format::Obj, &shapes::bumpy_sphere(400)).unwrap();
        let original = Document::parse(file, None).unwrap();
        let options =
            EmbedOptions { parameters: preset.parameters(), fewer_if_small: true, ..EmbedOptions::default() };
        let key = embed(&original, Secret([secret; 32]), &options).unwrap().key;
        let detector = Detector::new(&original, key).unwrap();
        let file = detector.prepared_basis();
        (detector, file)
    }

    /// With the hash that these bytes have to end in.
    fn sealed(mut content: Vec<u8>) -> Vec<u8> {
        let hash = Sha256::digest(&content);
        content.extend(hash);
        content
    }

    fn content() -> Vec<u8> {
        MADE.1[..MADE.1.len() - 32].to_vec()
    }

    #[test]
    fn a_basis_survives_its_file_to_the_bit() {
        let (detector, file) = &*MADE;
        let stored = PreparedBasis::parse(file, detector.key()).unwrap();
        assert_eq!(&stored.0, detector.basis());
        assert_eq!(stored.0.digest(), detector.basis().digest());
    }

    #[test]
    fn the_file_serves_all_keys_of_the_same_basis_and_no_others() {
        let (other, _) = made(2, Preset::Robust);
        assert!(PreparedBasis::parse(&MADE.1, other.key()).is_ok());
        let (paper, _) = made(1, Preset::Paper);
        assert_eq!(PreparedBasis::parse(&MADE.1, paper.key()), Err(PreparedBasisError::Unrelated));
    }

    #[test]
    fn vectors_survive_their_file_and_sizes_are_not_believed() {
        let (detector, _) = &*MADE;
        let points = &detector.model().soup().points;
        let field =
            |i: u32| (i..points.len() as u32).map(|v| (v, points[v as usize].coords * 1e-3)).collect();
        let basis = Basis::of_fields(points.len(), (0..16).map(field).collect());
        let original = Document::parse(encode(Format::Obj, detector.model().soup()).unwrap(), None).unwrap();
        let digest = OriginalDigest::of(original.parts());
        let old = detector.key();
        let options = BasisOptions { coefficients: 16, ..old.parameters.basis };
        let parameters = Parameters { basis: options, ..old.parameters };
        let key =
            Key::new(&digest, old.identity.clone(), old.secret, parameters, &basis.digest(), old.derivation);
        let file = write(&basis, &key);
        let stored = PreparedBasis::parse(&file, &key).unwrap();
        assert_eq!(stored.0, basis);
        let content = &file[..file.len() - 32];
        for place in (VECTORS.len() + 32..VECTORS.len() + 32 + 64).step_by(8) {
            for size in [0, 1, u64::MAX, u64::MAX / 8, 1 << 40] {
                let mut forged = content.to_vec();
                forged[place..place + 8].copy_from_slice(&size.to_le_bytes());
                assert!(PreparedBasis::parse(&sealed(forged), &key).is_err(), "{size} at {place}");
            }
        }
        assert!(PreparedBasis::parse(&sealed(content[..content.len() - 5].to_vec()), &key).is_err());
    }

    #[test]
    fn an_edited_key_fits_no_file() {
        let refused = |edit: fn(&mut Key)| {
            let mut key = MADE.0.key().clone();
            edit(&mut key);
            assert_eq!(PreparedBasis::parse(&MADE.1, &key), Err(PreparedBasisError::Unrelated));
        };
        refused(|key| key.parameters.basis.coefficients -= 1);
        refused(|key| key.parameters.basis.function = sombrero_basis::BasisFunction::Hat);
        refused(|key| key.parameters.basis.amplitudes = sombrero_basis::Amplitudes::Heights);
        refused(|key| key.original_sha256[0] ^= 1);
        refused(|key| key.basis_sha256[0] ^= 1);
        refused(|key| key.watermark.truncate(5));
    }

    #[test]
    fn other_files_are_told_apart() {
        let parse = |file: &[u8]| PreparedBasis::parse(file, MADE.0.key()).unwrap_err();
        assert_eq!(parse(b""), PreparedBasisError::Foreign);
        assert_eq!(parse(b"{\"format\": \"sombrero-key\"}"), PreparedBasisError::Foreign);
        assert_eq!(parse(b"sombrero prepared 2\n"), PreparedBasisError::Version);
        assert_eq!(parse(MAGIC), PreparedBasisError::Damaged);
        assert_eq!(parse(&sealed(MAGIC.to_vec())), PreparedBasisError::Unrelated);
    }

    #[test]
    fn a_forged_basis_is_not_the_keys() {
        let mut forged = content();
        let last = forged.len() - 1;
        // The sign of a value.
        forged[last] ^= 0x80;
        let parsed = PreparedBasis::parse(&sealed(forged), MADE.0.key());
        assert_eq!(parsed, Err(PreparedBasisError::Unrelated));
    }

    /// The forgery of the first version: with the signs of the functions chosen to suit, any suspect carried the mark of a
    /// key that was made up along with the file. Now w follows from the signs too, and suits them no more; and confirming
    /// finds the basis out.
    #[test]
    fn signs_that_suit_a_watermark_give_another_watermark() {
        let file = encode(Format::Obj, &shapes::bumpy_sphere(400)).unwrap();
        let original = Document::parse(file, None).unwrap();
        let (detector, _) = &*MADE;
        let (key, points) = (detector.key(), &detector.model().soup().points);
        let bump = |p: &Point3<f64>| p + 1e-3 * Vector3::new((9.0 * p.y).sin(), (7.0 * p.z).cos(), p.x * p.y);
        let unmarked: Vec<_> = points.iter().map(bump).collect();
        let suspect = Document::parse(original.with_points(&unmarked).unwrap(), None).unwrap();
        let options = DetectOptions { method: Method::Paper, ..DetectOptions::default() };
        let look = |detector: &Detector| detector.detect(&detector.suspect(&suspect), &options).unwrap();
        let honest = look(detector);
        assert!(!honest.detected);

        let suits =
            |(w, found): (&f64, &Option<f64>)| if w * found.unwrap_or(0.0) < 0.0 { -1.0 } else { 1.0 };
        let signs: Vec<f64> = key.watermark.iter().zip(&honest.extracted).map(suits).collect();
        let basis = turned(detector.basis(), &signs);
        let digest = OriginalDigest::of(original.parts());
        let forged = Key::new(
            &digest,
            key.identity.clone(),
            key.secret,
            key.parameters,
            &basis.digest(),
            Derivation::STANDARD,
        );
        let stored = PreparedBasis::parse(&write(&basis, &forged), &forged).unwrap();
        let deceived = Detector::with_prepared_basis(&original, forged, stored).unwrap();
        assert!(!look(&deceived).detected);
        assert!(matches!(deceived.confirm(), Err(DetectError::Key(Mismatch::Basis))));
        assert!(detector.confirm().is_ok());
    }

    fn turned(basis: &Basis, signs: &[f64]) -> Basis {
        let turn = |(f, sign): (&Function, &f64)| Function { direction: f.direction * *sign, ..*f };
        let lengths: Vec<usize> = basis.values().col_iter().map(|column| column.nnz()).collect();
        let (rows, values) = (basis.values().row_indices().to_vec(), basis.values().values().to_vec());
        let functions = basis.functions().iter().zip(signs).map(turn).collect();
        Basis::from_parts(basis.vertex_count(), functions, &lengths, rows, values).unwrap()
    }

    #[test]
    fn sizes_are_not_believed() {
        let start = MAGIC.len() + 32;
        for place in [start, start + 8, start + 16 + RECORD - 8] {
            for size in [0, 1, u64::MAX, u64::MAX / 60, 1 << 40] {
                let mut forged = content();
                forged[place..place + 8].copy_from_slice(&size.to_le_bytes());
                assert!(PreparedBasis::parse(&sealed(forged), MADE.0.key()).is_err(), "{size} at {place}");
            }
        }
    }

    proptest! {
        #[test]
        fn changed_bytes_are_damage(place in any::<prop::sample::Index>(), change in 1u8..) {
            let mut file = MADE.1.clone();
            *place.get_mut(&mut file) ^= change;
            prop_assert!(PreparedBasis::parse(&file, MADE.0.key()).is_err());
        }

        #[test]
        fn a_part_of_the_file_is_damage(end in any::<prop::sample::Index>(), hashed: bool) {
            let end = end.index(content().len());
            let part = if hashed { sealed(content()[..end].to_vec()) } else { MADE.1[..end].to_vec() };
            prop_assert!(PreparedBasis::parse(&part, MADE.0.key()).is_err());
        }

        /// Most changes are near the start, where the sizes are, and the hash fits the changed bytes.
        #[test]
        fn forged_bytes_are_an_error_or_the_same_basis(
            changes in prop::collection::vec((prop_oneof![0usize..400, 0usize..1 << 20], any::<u8>()), 1..8),
            cut in prop::option::of(0usize..1 << 16)
        ) {
            let mut forged = content();
            for (place, byte) in changes {
                let place = place % forged.len();
                forged[place] = byte;
            }
            if let Some(cut) = cut {
                forged.truncate(forged.len().saturating_sub(cut));
            }
            let parsed = PreparedBasis::parse(&sealed(forged), MADE.0.key());
            prop_assert!(parsed.is_err() || parsed.is_ok_and(|s| s.0.digest() == MADE.0.basis().digest()));
        }

        #[test]
        fn any_bytes_are_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300), hashed: bool) {
            let mut file = MAGIC.to_vec();
            file.extend(identity(MADE.0.key()));
            file.extend(bytes);
            let file = if hashed { sealed(file) } else { file };
            prop_assert!(PreparedBasis::parse(&file, MADE.0.key()).is_err());
        }
    }
}
