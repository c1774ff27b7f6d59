# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers of the engine, in lines for people who see only these."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

#: What the engine does, by its names for it.
_STAGES = {
    "weld": "Joining seams",
    "repair": "Mending a working copy",
    "conversion": "Taking the shape apart",
    "basis": "Choosing where the mark goes",
    "fields": "Choosing where the mark goes",
    "derivation": "Making the key",
    "insert": "Moving vertices",
    "fidelity": "Measuring what is seen",
    "read back": "Reading the copy back",
    "matching": "Comparing shapes",
    "registration": "Aligning",
    "resampling": "Comparing surfaces",
    "comparing": "Comparing surfaces",
    "extraction": "Reading the mark",
    "keys": "Reading keys",
    "test": "Testing",
    "tests": "Testing",
}


def stage(name: str) -> str:
    """What goes on, for a progress bar."""
    return _STAGES.get(name, name.capitalize() or "Beginning")


def share(done: int, of: int) -> float:
    """How much of a stage is done."""
    return min(done / of, 1.0) if of else 0.0


def error(error: BaseException | str, original: Path | None = None) -> str:
    """One sentence; of a file that was exported for this alone it says so."""
    text = " ".join(str(error).split()) or type(error).__name__
    # The engine speaks of arguments, which nobody sees here.
    for force in ("force=True", "--force"):
        text = text.replace(f"choose another folder or give {force}", "choose another folder or file name")
        text = text.replace(f" or give {force}", "")
    text = text.replace("a finer mesh, with some relief", "a finer mesh, with some relief (Subdivision Surface, sculpting)")
    if original is not None:
        text = text.replace(str(original), "What was exported")
    return text


def marked(answer: Any, copy: Path, folder: Path) -> list[str]:
    """What marking came to."""
    moved = 100 * answer.distortion.relative_max
    return [
        f"Marked: publish {copy.name}",
        f"Keep the folder {folder.name} secret and as it is: nothing is found without it",
        f"No vertex moved by more than {moved:.2g} % of the size",
        *answer.warnings,
    ]


def copied(answer: Any, folder: Path, original: Path) -> list[str]:
    """What copies for buyers came to."""
    kept = f", {answer.kept} from before" if answer.kept else ""
    failed = f", {answer.failed} failed" if answer.failed else ""
    return [
        f"New copies in {folder.name}: {answer.written}{kept}{failed}",
        *failures(answer),
        f"Send each buyer one file; keep {folder.name}/keys and {original.parent.name} secret",
    ]


def failures(answer: Any) -> list[str]:
    """Why there is no copy, for each buyer without one."""
    return [f"{one.recipient}: {error(one.error.message)}" for one in answer.copies if one.status == "failed"]


def checked(answer: Any, suspect: str, original: Path) -> list[str]:
    """A verdict."""
    if not answer:
        return [
            f"Not found: no mark of {original.name} in {suspect}",
            f"log10 p {answer.log10_p:.1f}; found is {math.log10(answer.threshold):.0f} or less",
            *answer.warnings,
        ]
    return [f"Found: {suspect} carries the mark of {original.name}", *_weight(answer), *answer.warnings]


def _weight(answer: Any) -> list[str]:
    lines = [_chance(answer.log10_p)]
    lines.append({
        "anybody": "That convinces anybody",
        "owner": "That convinces the key's owner; the report says what others would ask",
    }.get(answer.claim.convinces, "That convinces nobody else"))
    return [*lines, f"{100 * answer.coverage:.0f} % of the original is there"]


def _chance(log10_p: float) -> str:
    return f"An unmarked model matches as well once in 10^{-log10_p:.0f} times"


def traced(answer: Any, suspect: str) -> list[str]:
    """Whose copy it is."""
    named = [one for one in answer.recipients if one.named]
    if not named:
        lines = [f"Nobody is named: {suspect} is not a copy of these {answer.keys} keys"]
    elif len(named) == 1:
        lines = [f"Named: {suspect} is the copy of {_who(named[0])}", _chance(named[0].log10_p)]
    else:
        lines = [f"Named: {suspect} was made from copies of {len(named)} buyers", *(_who(one) for one in named)]
    if answer.skipped:
        lines.append(f"{len(answer.skipped)} files are no keys of this original and were passed over")
    return [*lines, *answer.warnings]


def _who(recipient: Any) -> str:
    return recipient.recipient or Path(recipient.key).stem
