//! The formats by name. What is known of each stands in its row, see the registry.

/// A mesh format.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    #[default]
    Obj,
    /// PLY with an ASCII body.
    PlyAscii,
    /// PLY with a binary body, least significant byte first.
    PlyBinaryLittleEndian,
    /// PLY with a binary body, most significant byte first.
    PlyBinaryBigEndian,
    /// OFF and its variants with colours, normals or texture coordinates.
    Off,
    /// OFF in binary.
    OffBinary,
    /// STL as text.
    StlAscii,
    /// STL in 50-byte records.
    StlBinary,
    /// glTF as JSON, its buffers inside or in files beside it.
    Gltf,
    /// glTF as one binary file.
    Glb,
    /// 3MF: models as XML in a ZIP archive.
    ThreeMf,
}
