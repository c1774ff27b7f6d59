# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where files go. Originals and keys have folders of their own, and none is ever replaced: without them, copies that are
out cannot be detected."""

from __future__ import annotations

import filecmp
import shutil
from pathlib import Path

SUFFIXES = (".glb", ".obj", ".stl", ".ply")


class Unusable(Exception):
    """What was given cannot be used; says what to do."""


def copy_named(name: str) -> Path:
    """The file for the marked copy: GLB where the name does not say."""
    if not name.strip() or name.endswith(("/", "\\")):
        raise Unusable("There is no file name; give one, such as vase.glb")
    path = Path(name)
    if not path.suffix:
        path = path.with_suffix(".glb")
    if path.suffix.lower() not in SUFFIXES:
        raise Unusable(f"{path.name}: Sombrero exports {', '.join(SUFFIXES)}; choose one of these endings")
    if not path.parent.is_dir():
        raise Unusable(f"{path.parent}: there is no such folder; choose another")
    return path


def secret_folder(copy: Path, secrets: str) -> Path:
    """A new folder for the original and the key of a copy: in ``secrets``, or beside the copy."""
    parent = Path(secrets) if secrets else copy.parent
    for number in range(1, 10_000):
        folder = parent / (f"{copy.stem}-secret" + (f"-{number}" if number > 1 else ""))
        try:
            folder.mkdir(parents=True)
            folder.chmod(0o700)
        except FileExistsError:
            continue
        except OSError as error:
            raise Unusable(f"{folder}: cannot be made ({error.strerror}); choose another folder") from None
        return folder
    raise Unusable(f"{parent}: it has thousands of folders for {copy.stem}; choose another folder")


def same_as_before(original: Path, secrets: str, copy: Path) -> Path | None:
    """The original that was exported before with the same bytes, if there is one: its list of buyers can go on."""
    parent = Path(secrets) if secrets else copy.parent
    before = sorted(parent.glob(f"{_plain(copy.stem)}-secret*/{_plain(original.name)}"))
    return next((old for old in before if old != original and filecmp.cmp(old, original, shallow=False)), None)


def copies_folder(copy: Path, original: Path) -> Path:
    """The folder for buyers' copies: each original has one, named as its own is."""
    return copy.parent / original.parent.name.replace(f"{copy.stem}-secret", f"{copy.stem}-copies")


def fresh_file(folder: Path, stem: str, suffixes: tuple[str, ...]) -> Path:
    """A name without its suffix that nothing in the folder has with any of these suffixes."""
    for number in range(1, 100_000):
        name = _plain_name(stem) + (f"-{number}" if number > 1 else "")
        if not any((folder / (name + suffix)).exists() for suffix in suffixes):
            return folder / name
    raise Unusable(f"{folder}: it has too many files of {stem}; take some away")


def key_of(original: Path) -> Path:
    """The key beside an original."""
    key = original.with_suffix(".key")
    if key.is_file():
        return key
    raise Unusable(f"{key}: there is no such key; choose the one that was made with {original.name}")


def remove_unless(is_needed: bool, folder: Path) -> None:
    """Takes away a secret folder that was just made, unless there is a key, which is worth nothing without it."""
    if not is_needed:
        shutil.rmtree(folder, ignore_errors=True)


def beside(original: Path) -> list[Path]:
    """What an exporter wrote beside an original, such as materials and pictures."""
    return sorted(p for p in original.parent.iterdir() if p.is_file() and p != original and p.suffix != ".key")


def _plain(name: str) -> str:
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)


def _plain_name(name: str) -> str:
    """A name that may be a file's: that of an object may have anything in it."""
    kept = "".join(c if c.isalnum() or c in "-_. " else "_" for c in name).strip(" .")
    return kept[:80] or "suspect"
