"""Keys in memory."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ._errors import FileError, SecretError


class Key:
    """A secret key, as ``embed`` makes it: with the original it finds the mark, and takes it out.

    ``Key(path)`` reads a key file, ``Key(content)`` takes the bytes of one. What is printed of a key is not secret.
    """

    __slots__ = ("_content", "_fields")

    def __init__(self, source: str | os.PathLike[str] | bytes) -> None:
        if isinstance(source, bytes):
            content, name = source, "key"
        else:
            name = os.fspath(source)
            try:
                content = Path(name).read_bytes()
            except OSError as error:
                raise FileError(f"{name}: {error.strerror}; give the key that `embed` wrote", "read") from None
        try:
            fields = json.loads(content)
            self._fields: dict[str, object] = {name: fields[name] for name in ("owner", "recipient")}
        except (ValueError, TypeError, KeyError):
            raise SecretError(f"{name}: this is no key; give the one that `embed` wrote", "key") from None
        self._content = content

    @property
    def content(self) -> bytes:
        """The bytes of the key file. Secret."""
        return self._content

    @property
    def owner(self) -> str:
        """Whose mark it is."""
        return str(self._fields["owner"])

    @property
    def recipient(self) -> str:
        """Whose copy it is; may be empty."""
        return str(self._fields["recipient"])

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the key file, readable by you alone. One that is there stays unless ``force``."""
        name = os.fspath(path)
        try:
            if force and os.path.exists(name):
                os.remove(name)
            handle = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(self._content)
        except FileExistsError:
            message = f"{name}: there is a file already; choose another name or give force=True"
            raise FileError(message, "write") from None
        except OSError as error:
            raise FileError(f"{name}: cannot be written ({error.strerror}); choose another place", "write") from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Key) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    def __repr__(self) -> str:
        return f"Key(owner={self.owner!r}, recipient={self.recipient!r})"

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self._content,)
