"""The command ``sombrero``, and any of its commands called from Python."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import Any

from . import _native
from ._answers import Answer
from ._call import Call


def main() -> None:
    """What the program ``sombrero`` of the package does."""
    # Python would only note that somebody wants it to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_native.main(["sombrero", *sys.argv[1:]]))


def command(
    *arguments: str,
    threads: int | None = None,
    progress: Callable[[str, int, int], object] | None = None,
) -> list[Answer]:
    """The answers of ``sombrero ARGUMENTS --json``: of most commands one, of folders one for each file and a summary.

    For what has no function of its own: ``command("catalogue", "add", "models", "originals", "--keep")``,
    ``command("embed", "vase.obj", "--recipients", "buyers.csv", "--out-dir", "copies")``, ``command("commit", ...)``.
    Of several files one that failed has an answer with the field ``error``.

    Raises:
        SombreroError: as the command fails.
    """
    call = Call(*arguments)
    answers, _, _ = call.answers(threads, progress)
    return [Answer(one) for one in answers]


