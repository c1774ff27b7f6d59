"""One call of the engine: the command's arguments, with what is in memory under names of its own."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from typing import Any

from . import _native
from ._errors import UsageError
from ._key import Key
from ._mesh import Arrays, MeshLike, arrays_of, path_of

Progress = Callable[[str, int, int], object]


def named(what: str) -> str:
    """The name of what is in memory, as Python has ``<stdin>``."""
    return f"<{what}>"


class Call:
    """Arguments of the command, and meshes, keys and secrets in memory."""

    def __init__(self, *words: str) -> None:
        self.words: list[str] = list(words)
        self.meshes: dict[str, Arrays] = {}
        self.files: dict[str, bytes] = {}
        self.out_meshes: list[str] = []
        self.out_files: list[str] = []

    def mesh(self, mesh: MeshLike, what: str, option: str | None = None) -> bool:
        """Adds a mesh; gives whether it is a file."""
        path = path_of(mesh)
        if path is not None and option is None and os.path.isdir(path):
            raise UsageError(f"{path}: a folder, not a file; call it for each of its files")
        if path is None:
            self.meshes[named(what)] = arrays_of(mesh, what)
        self._add(option, named(what) if path is None else path)
        return path is not None

    def key(self, key: str | os.PathLike[str] | Key) -> None:
        """Adds a key."""
        if isinstance(key, Key):
            self.files[named("key")] = key.content
        self.option("key", named("key") if isinstance(key, Key) else os.fspath(key))

    def key_file(self, key: str | os.PathLike[str] | Key) -> None:
        """Adds a key that is what the command works on."""
        if isinstance(key, Key):
            self.files[named("key")] = key.content
        self._add(None, named("key") if isinstance(key, Key) else os.fspath(key))

    def keys(self, keys: str | os.PathLike[str] | Iterable[str | os.PathLike[str] | Key] | None) -> None:
        """Adds a folder of keys, or the keys one by one."""
        if keys is None:
            return
        if isinstance(keys, (str, os.PathLike)):
            self.option("keys", os.fspath(keys))
            return
        contents = [(key if isinstance(key, Key) else Key(key)).content for key in keys]
        if not contents:
            raise UsageError("keys: there is none; give a folder or some keys")
        # By number, so that answers name them in their order.
        self.files |= {f"{named('keys')}/{number:06}": content for number, content in enumerate(contents)}
        self.option("keys", named("keys"))

    def secret(self, secret: str | bytes | None) -> None:
        """Adds a secret of 32 bytes, or 64 hexadecimal digits. It is in no argument."""
        if secret is not None:
            self.files[named("secret")] = secret.hex().encode() if isinstance(secret, bytes) else secret.encode()
            self.option("secret_file", named("secret"))

    def option(self, name: str, value: object) -> None:
        """Adds an option unless it is None or False."""
        if value is None or value is False:
            return
        flag = f"--{name.replace('_', '-')}"
        # In one word, so that a value may begin with a dash.
        self.words.append(flag if value is True else f"{flag}={_word(value)}")

    def options(self, **values: object) -> None:
        """Adds options."""
        for name, value in values.items():
            self.option(name, value)

    def _add(self, option: str | None, word: str) -> None:
        if option is not None:
            self.option(option, word)
        elif word.startswith("-"):
            # A name, whatever it begins with; `-` would be standard input.
            self.words.append(os.path.join(os.curdir, word))
        else:
            self.words.append(word)

    def answers(
        self, threads: int | None, progress: Progress | None
    ) -> tuple[list[dict[str, Any]], dict[str, Arrays], dict[str, bytes]]:
        """What the command answers, and what it wrote to memory."""
        _check(threads, progress)
        text, (meshes, files) = _native.answers(
            self.words, self.meshes, self.files, self.out_meshes, self.out_files, threads, progress
        )
        return json.loads(text), dict(meshes), files

    def answer(self, threads: int | None, progress: Progress | None) -> dict[str, Any]:
        """The one answer."""
        return self.answers(threads, progress)[0][0]

    def standing(self, threads: int | None, progress: Progress | None) -> _native.Standing:
        """The command with what it reads once in memory, for suspects that come later."""
        _check(threads, progress)
        return _native.Standing(self.words, self.meshes, self.files, threads, progress)

    def looked(
        self,
        standing: _native.Standing,
        report: str | os.PathLike[str] | None,
        threads: int | None,
        progress: Progress | None,
    ) -> dict[str, Any]:
        """What such a command says of the one mesh."""
        _check(threads, progress)
        page = None if report is None else os.fspath(report)
        fields: dict[str, Any] = json.loads(standing.look(self.words[0], self.meshes, page, threads, progress))
        return fields


def _word(value: object) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    return repr(float(value)) if isinstance(value, float) else str(value)


def _check(threads: int | None, progress: Progress | None) -> None:
    if threads is not None and (not isinstance(threads, int) or isinstance(threads, bool) or not 1 <= threads <= 1024):
        raise UsageError(f"threads={threads!r}: give a whole number from 1 to 1024, or None for all cores")
    if progress is not None and not callable(progress):
        raise UsageError("progress: give a function of a stage's name, how much is done, and of how much")
