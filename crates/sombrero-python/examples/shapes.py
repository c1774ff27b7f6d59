"""A model for the examples: a vase with a wavy wall, as arrays or as an OBJ file."""

from pathlib import Path

import numpy as np


def vase(around: int = 56, along: int = 36) -> tuple[np.ndarray, np.ndarray]:
    """Vertices ``(around * along + 2, 3)`` and triangles of a closed surface of revolution, with waves."""
    t, a = np.meshgrid(np.linspace(0.03, np.pi - 0.03, along), np.arange(around) * 2 * np.pi / around, indexing="ij")
    radius = np.sin(t) * (1 + 0.25 * np.sin(3 * t + 0.5)) * (1 + 0.06 * np.cos(5 * a + 2 * t) + 0.03 * np.sin(2 * a))
    wall = np.stack([radius * np.cos(a), radius * np.sin(a), -1.6 * np.cos(t)], axis=-1).reshape(-1, 3)
    vertices = np.vstack([wall, [[0, 0, -1.62], [0, 0, 1.62]]])

    ring = np.arange(around)
    following = (ring + 1) % around
    rows = np.arange(along - 1)[:, None] * around
    lower = np.stack([rows + ring, rows + following, rows + around + following], axis=-1)
    upper = np.stack([rows + ring, rows + around + following, rows + around + ring], axis=-1)
    bottom = np.stack([np.full(around, around * along), following, ring], axis=-1)
    last = (along - 1) * around
    top = np.stack([np.full(around, around * along + 1), last + ring, last + following], axis=-1)
    return vertices, np.vstack([lower.reshape(-1, 3), upper.reshape(-1, 3), bottom, top])


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    """An OBJ file."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("# made for an example\n" + "\n".join(lines) + "\n")
    return path
