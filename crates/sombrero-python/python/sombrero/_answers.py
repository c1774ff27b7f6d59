"""Answers: the JSON objects of the command, with their fields as attributes."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._key import Key


class Answer:
    """An answer that cannot be changed. Fields are attributes and items; objects within are answers themselves.

    The fields are those of the command's ``--json``. Later versions may add some, never take one away.
    """

    __slots__ = ("_fields",)
    _shown: tuple[str, ...] = ()

    _fields: dict[str, Any]

    def __init__(self, fields: dict[str, Any]) -> None:
        object.__setattr__(self, "_fields", fields)

    def __getitem__(self, name: str) -> Any:
        return _wrapped(self._fields[name])

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no field {name!r}; it has {', '.join(self)}") from None

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("an answer cannot be changed")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("an answer cannot be changed")

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def to_dict(self) -> dict[str, Any]:
        """The fields as a dictionary of their own, objects within as dictionaries."""
        return copy.deepcopy(self._fields)

    def to_json(self, **options: Any) -> str:
        """The object as JSON text, without arrays; ``options`` are those of :func:`json.dumps`."""
        plain = {name: value for name, value in self._fields.items() if not isinstance(value, (np.ndarray, Key))}
        return json.dumps(plain, **options)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._fields]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Answer) and self.to_json() == other.to_json()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shown = self._shown or tuple(self._fields)
        said = ", ".join(f"{name}={_brief(self._fields[name])}" for name in shown if name in self._fields)
        return f"{type(self).__name__}({said})"

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self._fields,)


def _wrapped(value: Any) -> Any:
    if isinstance(value, dict):
        return Answer(value)
    if isinstance(value, list):
        return [_wrapped(one) for one in value]
    return value


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{value.dtype} array {value.shape}>"
    if isinstance(value, (dict, list)) and len(value) > 6:
        return f"<{len(value)} entries>"
    return repr(value)


class Embedding(Answer):
    """A marked copy. Lengths are in model units, or shares of the largest side where the name says ``relative_``."""

    _shown = ("output", "points", "key", "coefficients", "epsilon", "distortion", "log10_p", "warnings")

    output: str
    """Where the copy is; of files only."""
    points: NDArray[np.float64]
    """The marked vertices ``(n, 3)`` in the order of the original; of arrays only."""
    key: Any
    """The secret key: its path, or a :class:`Key` of arrays for which no path was given."""
    vertices: int
    """How many there are."""
    faces: int
    coefficients: int
    epsilon: float
    basis: str
    distortion: Any
    """``max``, ``rms``, ``relative_max``, ``relative_rms``."""
    fidelity: Any
    log10_p: float
    log10_p_after_noise: float
    log10_p_halved: float | None
    seconds: Any
    warnings: list[str]


class Detection(Answer):
    """Whether a suspect carries the mark. True in a condition if it does."""

    _shown = ("detected", "log10_p", "threshold", "correlation", "coverage", "warnings")

    detected: bool
    p_value: float
    """The chance that an unmarked mesh matches as well; 0 when it underflows."""
    log10_p: float
    """Its decimal logarithm, corrected for all variants tried; always finite."""
    threshold: float
    correlation: float
    coefficients_used: int
    coverage: float
    """The share of the original's area that was found on the suspect."""
    method: str
    variant: Any
    variants: list[Any]
    registration: Any
    """``matrix`` (4 x 4, suspect to original) and ``rms``; None where the suspect was taken as it stands."""
    parts: list[Any]
    claim: Any
    """Whom the finding convinces."""
    budget_spent: bool
    seconds: Any
    warnings: list[str]

    def __bool__(self) -> bool:
        return bool(self._fields["detected"])


class Trace(Answer):
    """Whose copy a suspect is. True in a condition if anybody is named."""

    _shown = ("found", "recipients", "threshold", "warnings")

    found: bool
    recipients: list[Any]
    """``key``, ``recipient``, ``named``, ``log10_p`` of each key, best first."""
    keys: int
    threshold: float
    coverage: float
    skipped: list[Any]
    seconds: Any
    warnings: list[str]

    def __bool__(self) -> bool:
        return bool(self._fields["found"])


class Search(Answer):
    """Which original of a catalogue a suspect was made from. True in a condition if a mark was found; without keys, if
    there is a candidate."""

    _shown = ("found", "candidates", "tested")

    suspect: str
    found: bool
    candidates: list[Any]
    """``original``, ``score``, ``log10_p`` (None if no key was tested), ``key``, ``recipient``, best first."""
    tested: bool
    threshold: float
    tests: int
    seconds: Any

    def __bool__(self) -> bool:
        return bool(self._fields["found"])


class Info(Answer):
    """What a mesh is. Lengths in model units."""

    _shown = ("format", "vertices", "triangles", "components", "markable", "warnings")

    format: str
    vertices: int
    points: int
    triangles: int
    components: int
    boundary_loops: int
    boundary_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    degenerate_faces: int
    unused_vertices: int
    genus: int | None
    bounding_box: Any
    area: float | None
    volume: float | None
    attributes: list[str]
    markable: bool
    capacity: int
    warnings: list[str]


class Comparison(Answer):
    """How far two meshes are apart. Lengths in model units, or shares of the first one's largest side."""

    _shown = ("hausdorff", "rms", "mean", "relative_hausdorff", "relative_rms", "vertex_rms")

    hausdorff: float
    rms: float
    mean: float
    relative_hausdorff: float
    relative_rms: float
    vertex_rms: float
    """Only where connectivity agrees, as ``vertex_max`` and ``fidelity``."""
    vertex_max: float
    fidelity: Any


class Attacked(Answer):
    """What is left after attacks."""

    _shown = ("output", "points", "triangles", "attacks", "kept_file")

    output: str
    """Where it is; of files only."""
    points: NDArray[np.float64]
    """Vertices ``(n, 3)``; of arrays only."""
    triangles: NDArray[np.int64]
    """Triangles ``(m, 3)``; of arrays only."""
    attacks: list[str]
    seed: int
    vertices: int
    faces: int
    kept_file: bool


class Verification(Answer):
    """Whether a key is genuine: its watermark and basis follow from its secret and the original."""

    _shown = ("genuine", "owner", "recipient", "commitment")

    genuine: bool
    owner: str
    recipient: str
    coefficients: int
    epsilon: float
    basis: str
    original_sha256: str
    basis_sha256: str
    commitment: str
    timestamp: Any
