//! Rows that the paper's table does not have. Nothing is known about these suspects, not even a rough pose.

use super::paper::Steps::Both;
use super::paper::{Row, row};

const NONE: [i8; 4] = [0; 4];

pub(crate) const BEYOND: [Row; 14] = [
    row("affine", "affine, condition 1.5", "simplify:ratio=0.5 affine:strength=0.5", Both, NONE),
    row(
        "affine+crop",
        "affine, cropped",
        "crop:fraction=0.333 simplify:ratio=0.5 affine:strength=0.5",
        Both,
        NONE,
    ),
    row("projective", "projective, 0.1", "simplify:ratio=0.5 transform projective:strength=0.1", Both, NONE),
    row(
        "projective+crop",
        "projective, cropped",
        "crop:fraction=0.333 simplify:ratio=0.5 transform projective:strength=0.1",
        Both,
        NONE,
    ),
    row("ffd", "free form, 2 %", "simplify:ratio=0.5 ffd:strength=0.02 transform", Both, NONE),
    row(
        "ffd+crop",
        "free form, cropped",
        "crop:fraction=0.333 simplify:ratio=0.5 ffd:strength=0.02 transform",
        Both,
        NONE,
    ),
    row("iso256", "isosurface, 256 cells", "isosurface:resolution=256 transform", Both, NONE),
    row("iso128", "isosurface, 128 cells", "isosurface:resolution=128 transform", Both, NONE),
    row("iso64", "isosurface, 64 cells", "isosurface:resolution=64 transform", Both, NONE),
    row("remesh", "remeshed, mean edge length", "remesh:length=1 transform", Both, NONE),
    row("1/20", "simplify 1/20", "simplify:ratio=0.05 transform", Both, NONE),
    row("J2", "2nd mark, robust preset", "watermark:preset=robust", Both, NONE),
    row(
        "R2",
        "R, 2nd mark of the robust preset",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark:preset=robust crop:fraction=0.333",
        Both,
        NONE,
    ),
    row(
        "plane",
        "a random third cut away, simplify 1/2",
        "transform crop:fraction=0.333 transform simplify:ratio=0.5",
        Both,
        NONE,
    ),
];
