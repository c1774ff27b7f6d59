//! What a catalogue remembers of a model beside its shape.

/// A model of a catalogue: how it is called and where its file is. The catalogue never opens that file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Entry {
    /// Unique within a catalogue, not empty.
    pub name: String,
    /// SHA-256 of the file, or whatever else tells the caller that a file is the one that was added.
    pub digest: [u8; 32],
    /// Where the file is, as the caller writes it.
    pub place: String,
    /// Whatever else the caller wants back, such as a line of JSON; may be empty.
    pub note: String,
}

/// The most bytes that name, place and note may have each.
pub(crate) const LONGEST: usize = 1 << 16;

/// A number by which a name is looked up: FNV-1a (Fowler, Noll and Vo), 64 bits.
pub(crate) fn hash(name: &str) -> u64 {
    name.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
