"""Models and keys that several tests use."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"
sys.path.insert(0, str(EXAMPLES))

import sombrero  # noqa: E402
from shapes import vase, write_obj  # noqa: E402

SECRET = "0123456789abcdef" * 4


@pytest.fixture(scope="session")
def mesh() -> tuple[np.ndarray, np.ndarray]:
    """A small model."""
    return vase(48, 32)


@pytest.fixture(scope="session")
def marked(mesh: Any) -> sombrero.Embedding:
    """Its marked copy."""
    return sombrero.embed(mesh, owner="A. Museum", recipient="no. 7", secret=SECRET)


@pytest.fixture
def file(tmp_path: Path, mesh: Any) -> Path:
    """The same model as a file."""
    return write_obj(tmp_path / "vase.obj", *mesh)
