"""What counts as a mesh: a file, arrays, or an object of another library that has arrays."""

from __future__ import annotations

import os
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import MeshError

#: A path; ``(vertices, faces)``; or an object with ``vertices`` and ``faces`` (trimesh), ``vertices`` and ``triangles``
#: (Open3D), or ``points`` and ``faces`` (PyVista). Vertices are ``(n, 3)`` floats, faces ``(m, 3)`` vertex numbers from 0.
MeshLike = Union[str, "os.PathLike[str]", "tuple[Any, Any]", Any]

Arrays = tuple[NDArray[Any], NDArray[Any]]


def path_of(mesh: MeshLike) -> str | None:
    """The path, if it is one."""
    return os.fspath(mesh) if isinstance(mesh, (str, os.PathLike)) else None


def arrays_of(mesh: MeshLike, what: str) -> Arrays:
    """The arrays of what is no path; ``what`` it is to be is said in errors."""
    vertices, faces = _parts(mesh, what)
    vertices, faces = _array(vertices, f"{what}: vertices"), _array(faces, f"{what}: faces")
    if vertices.dtype.kind in "iu":
        vertices = vertices.astype(np.float64)
    # Other widths and byte orders; arrays of the usual ones are read where they lie.
    if vertices.dtype.kind == "f":
        vertices = vertices if vertices.dtype in (np.float64, np.float32) else vertices.astype(np.float64)
    if faces.dtype.kind in "iu":
        faces = faces if faces.dtype in (np.int64, np.int32, np.uint32, np.uint64) else faces.astype(np.int64)
    if len(vertices) == 0 or len(faces) == 0:
        missing = "vertex" if len(vertices) == 0 else "face"
        raise MeshError(f"{what}: there is no {missing}; give a mesh with triangles", "mesh")
    return vertices, faces


def _array(data: Any, name: str) -> NDArray[Any]:
    try:
        array = np.asarray(data)
    except (ValueError, TypeError) as error:
        raise MeshError(f"{name} cannot be read as an array ({error}); give rows of three numbers", "mesh") from None
    if array.ndim != 2 and array.size:
        raise MeshError(f"{name} has shape {array.shape}; give rows of three numbers", "mesh")
    return array if array.flags.aligned and array.dtype.isnative else np.array(array, dtype=array.dtype.newbyteorder("="))


def _parts(mesh: Any, what: str) -> tuple[Any, Any]:
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return mesh[0], mesh[1]
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "vertices") and hasattr(mesh, "triangles"):
        return mesh.vertices, mesh.triangles
    if hasattr(mesh, "points") and hasattr(mesh, "is_all_triangles"):
        if not mesh.is_all_triangles:
            raise MeshError(f"{what}: it has faces that are no triangles; give mesh.triangulate()", "mesh")
        return mesh.points, np.asarray(mesh.faces).reshape(-1, 4)[:, 1:]
    if hasattr(mesh, "vertex") and hasattr(mesh, "triangle"):
        return mesh.vertex.positions.cpu().numpy(), mesh.triangle.indices.cpu().numpy()
    message = (
        f"{what}: a {type(mesh).__name__} is no mesh; give a path, (vertices, faces), or an object that has both, "
        "such as a trimesh.Trimesh (of a scene: scene.to_mesh()), an Open3D TriangleMesh or a PyVista PolyData"
    )
    raise MeshError(message, "mesh")
