"""Exceptions, by what has to be mended."""

from __future__ import annotations

import re


class SombreroError(Exception):
    """Anything that sombrero refuses or cannot do.

    ``kind`` is the command's word for it, such as ``"read"`` or ``"mesh"``; ``str()`` is one sentence that says what is
    wrong and what to do about it.
    """

    def __init__(self, message: str, kind: str = "usage") -> None:
        super().__init__(message)
        self.kind = kind

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.kind)


class UsageError(SombreroError, ValueError):
    """An argument that makes no sense."""


class FileError(SombreroError, OSError):
    """A file that cannot be read or written, or that would be replaced."""

    def __str__(self) -> str:
        return str(self.args[0])


class MeshError(SombreroError, ValueError):
    """A mesh that cannot be marked, attacked, compared or looked at; arrays of a wrong shape or type."""


class SecretError(SombreroError, ValueError):
    """A key, secret, list of recipients, prepared file or timestamp that is damaged or belongs to another original."""


class CatalogueError(SombreroError):
    """A catalogue that cannot be used, or a passphrase that does not open it."""


class InternalError(SombreroError):
    """A mistake of sombrero's own. Please report it."""


_CLASSES: dict[str, type[SombreroError]] = {
    "usage": UsageError,
    "read": FileError,
    "write": FileError,
    "mesh": MeshError,
    "suspect": MeshError,
    "needs_resampling": MeshError,
    "attack": MeshError,
    "key": SecretError,
    "keys": SecretError,
    "secret": SecretError,
    "recipients": SecretError,
    "prepared": SecretError,
    "timestamp": SecretError,
    "catalogue": CatalogueError,
    "vault": CatalogueError,
    "passphrase": CatalogueError,
    "internal": InternalError,
}


def of_kind(kind: str, message: str) -> SombreroError:
    """The exception for a failure of the engine, whose sentences speak of the command's options."""
    message = message.replace("--force", "force=True")
    message = re.sub(r"(?<![\w-])--([a-z][a-z-]*[a-z])", lambda option: option[1].replace("-", "_") + "=", message)
    return _CLASSES.get(kind, SombreroError)(message, kind)
