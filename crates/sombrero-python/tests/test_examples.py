"""The gallery runs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from conftest import EXAMPLES

GALLERY = sorted(path for path in EXAMPLES.glob("*.py") if path.name != "shapes.py")


@pytest.mark.parametrize("example", GALLERY, ids=lambda path: path.stem)
def test_example(example: Path, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout
