# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes time, on a thread of its own, so that Blender goes on drawing. Nothing in it may touch Blender's data."""

from __future__ import annotations

import threading
from collections.abc import Callable

Progress = Callable[[str, int, int], None]


class Cancelled(Exception):
    """Somebody wants it to end."""


class Work:
    """A task that tells its progress, which raises :class:`Cancelled` in it once it is to end."""

    def __init__(self, task: Callable[[Progress], object], tidy: Callable[[], None] = lambda: None) -> None:
        """``tidy`` takes away what a task leaves that came to no good end."""
        self._task = task
        self._tidy = tidy
        self._cancelled = threading.Event()
        self._error: BaseException | None = None
        self._result: object = None
        # Replaced as a whole, so that a reader never sees half of it.
        self.progress = ("", 0, 0)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begins."""
        self._thread.start()

    def cancel(self) -> None:
        """Ends it at its next word."""
        self._cancelled.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether it is to end."""
        return self._cancelled.is_set()

    def is_over(self, wait: float = 0.0) -> bool:
        """Whether it has ended, after ``wait`` seconds at most."""
        self._thread.join(wait)
        return not self._thread.is_alive()

    def result(self) -> object:
        """What it came to; raises what it raised. Once it is over."""
        if self._error is not None:
            raise self._error
        return self._result

    def _run(self) -> None:
        try:
            self._result = self._task(self._tell)
        except BaseException as error:  # Whatever it is, it is for whoever waits.
            self._error = error
            self._tidy()

    def _tell(self, stage: str, done: int, of: int) -> None:
        self.progress = (stage, done, of)
        if self._cancelled.is_set():
            raise Cancelled


#: What goes on now: one thing at a time, since each uses all cores.
current: Work | None = None


def begin(work: Work) -> None:
    """Starts it as what goes on now."""
    global current
    current = work
    work.start()


def forget() -> None:
    """Nothing goes on any more."""
    global current
    current = None


def end() -> None:
    """Ends what goes on, and waits for that."""
    if current is not None:
        current.cancel()
        current.is_over(30.0)
        forget()
