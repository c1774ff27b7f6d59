from collections.abc import Callable
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__version__: str

_Arrays = tuple[NDArray[Any], NDArray[Any]]
_Progress = Callable[[str, int, int], object]

def main(arguments: list[str]) -> int: ...
def ply(vertices: NDArray[Any], faces: NDArray[Any], what: str) -> bytes: ...
def answers(
    arguments: list[str],
    meshes: dict[str, _Arrays],
    files: dict[str, bytes],
    out_meshes: list[str],
    out_files: list[str],
    threads: int | None,
    progress: _Progress | None,
) -> tuple[str, tuple[dict[str, tuple[NDArray[np.float64], NDArray[np.int64]]], dict[str, bytes]]]: ...
@final
class Standing:
    def __new__(
        cls,
        arguments: list[str],
        meshes: dict[str, _Arrays],
        files: dict[str, bytes],
        threads: int | None,
        progress: _Progress | None,
    ) -> Standing: ...
    def look(
        self,
        suspect: str,
        meshes: dict[str, _Arrays],
        report: str | None,
        threads: int | None,
        progress: _Progress | None,
    ) -> str: ...
