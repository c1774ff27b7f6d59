"""Robust, invisible watermarks in the shape of triangle meshes.

Mark a file, or arrays::

    import sombrero

    sombrero.embed("vase.obj", owner="A. Museum")          # vase-marked.obj to publish, vase.key to keep
    marked = sombrero.embed((vertices, faces), owner="A. Museum")
    marked.points, marked.key

and find the mark again in whatever turns up::

    if found := sombrero.detect("found.stl", original="vase.obj", key="vase.key"):
        print(found.log10_p)

Every function is a command of ``sombrero``, and computes what that does, to the bit. Answers have the fields of its
``--json``. Lengths are in model units. The interpreter is free while a function computes, so that threads run side by side.
"""

from ._answers import Answer, Attacked, Comparison, Detection, Embedding, Info, Search, Trace, Verification
from ._api import Detector, Searcher, attack, compare, detect, embed, info, search, to_ply, trace, verify
from ._command import command
from ._errors import (
    CatalogueError,
    FileError,
    InternalError,
    MeshError,
    SecretError,
    SombreroError,
    UsageError,
)
from ._key import Key
from ._mesh import MeshLike
from ._native import __version__

__all__ = [
    "Answer",
    "Attacked",
    "CatalogueError",
    "Comparison",
    "Detection",
    "Detector",
    "Embedding",
    "FileError",
    "Info",
    "InternalError",
    "Key",
    "MeshError",
    "MeshLike",
    "Search",
    "Searcher",
    "SecretError",
    "SombreroError",
    "Trace",
    "UsageError",
    "Verification",
    "__version__",
    "attack",
    "command",
    "compare",
    "detect",
    "embed",
    "info",
    "search",
    "to_ply",
    "trace",
    "verify",
]
