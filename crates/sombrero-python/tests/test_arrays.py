"""Arrays and objects of other libraries: what is taken, and what is refused with one clear exception."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sombrero
from conftest import SECRET


def embed(mesh: Any) -> sombrero.Embedding:
    return sombrero.embed(mesh, owner="A. Museum", recipient="no. 7", secret=SECRET)


def test_a_copy_has_the_vertices_in_their_order(mesh: Any, marked: sombrero.Embedding) -> None:
    vertices, _ = mesh
    assert marked.points.shape == vertices.shape and marked.points.dtype == np.float64
    moved = np.linalg.norm(marked.points - vertices, axis=1)
    assert 0 < moved.max() == pytest.approx(marked.distortion.max)
    assert marked.vertices == len(vertices) and marked.key.recipient == "no. 7"


@pytest.mark.parametrize("faces", [np.int32, np.uint32, np.uint64, np.int16, np.dtype(">i8")])
def test_integers_of_any_width_number_vertices(mesh: Any, marked: sombrero.Embedding, faces: Any) -> None:
    assert sombrero.to_ply((mesh[0], mesh[1].astype(faces))) == sombrero.to_ply(mesh)


def test_arrays_may_lie_anyhow_and_are_only_read(mesh: Any, marked: sombrero.Embedding) -> None:
    vertices, faces = mesh
    wide = np.zeros((len(vertices), 6))
    wide[:, ::2] = vertices
    fixed = vertices.copy()
    fixed.flags.writeable = False
    for same in (np.asfortranarray(vertices), wide[:, ::2], fixed, vertices.tolist(), vertices.astype(">f8")):
        assert sombrero.to_ply((same, faces)) == sombrero.to_ply(mesh)
    before = vertices.copy()
    embed((vertices, faces))
    assert (vertices == before).all()
    # Numbers of 32 bits are numbers: their copy is exact in 64.
    single = vertices.astype(np.float32)
    assert sombrero.to_ply((single, faces)) == sombrero.to_ply((single.astype(np.float64), faces))


WRONG: dict[str, tuple[Any, str]] = {
    "vertices of two columns": (lambda v, f: (v[:, :2], f), r"vertices has shape \[1538, 2\]"),
    "flat vertices": (lambda v, f: (v.ravel(), f), "vertices has shape"),
    "a fourth column of faces": (lambda v, f: (v, np.hstack([f, f[:, :1]])), r"faces has shape \[3072, 4\]"),
    "complex vertices": (lambda v, f: (v.astype(complex), f), "complex128|c16"),
    "words": (lambda v, f: (v.astype(str), f), "vertices has shape"),
    "real numbers of vertices": (lambda v, f: (v, f.astype(float)), "faces has shape"),
    "ragged rows": (lambda v, f: ([[0, 0, 0], [1]], f), "cannot be read as an array"),
    "nothing": (lambda v, f: (v[:0], f[:0]), "there is no vertex"),
    "no faces": (lambda v, f: (v, f[:0]), "there is no face"),
    "an empty list": (lambda v, f: ([], []), "there is no vertex"),
    "a vertex that is not there": (lambda v, f: (v, f + len(v)), "1538"),
    "a negative number": (lambda v, f: (v, f - 1), "negative"),
    "not a number": (lambda v, f: (np.where(v == v[5], np.nan, v), f), "not finite|finite"),
    "infinity": (lambda v, f: (np.where(v == v[5], np.inf, v), f), "finite"),
    "one object": (lambda v, f: object(), "object is no mesh"),
    "None": (lambda v, f: None, "NoneType is no mesh"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_once_and_clearly(mesh: Any, case: str) -> None:
    wrong, words = WRONG[case]
    with pytest.raises(sombrero.MeshError, match=words) as caught:
        embed(wrong(*mesh))
    assert caught.value.kind == "mesh" and isinstance(caught.value, ValueError)
    with pytest.raises(sombrero.MeshError):
        sombrero.info(wrong(*mesh))


def test_faces_that_carry_no_mark_are_refused(mesh: Any) -> None:
    vertices, _ = mesh
    with pytest.raises(sombrero.MeshError):
        embed((vertices, np.zeros((40, 3), int)))
    with pytest.raises(sombrero.MeshError):
        embed((np.eye(3), [[0, 1, 2]]))


def test_other_arguments_that_make_no_sense(mesh: Any, marked: sombrero.Embedding, file: Path, tmp_path: Path) -> None:
    suspect = (marked.points, mesh[1])
    with pytest.raises(sombrero.UsageError, match="preset"):
        sombrero.embed(mesh, preset="loud")
    with pytest.raises(sombrero.UsageError, match="output"):
        sombrero.embed(mesh, tmp_path / "copy.ply")
    with pytest.raises(sombrero.UsageError, match="threads"):
        sombrero.info(mesh, threads=0)
    with pytest.raises(sombrero.UsageError, match="threshold"):
        sombrero.detect(suspect, mesh, marked.key, threshold=-1.0)
    with pytest.raises(sombrero.UsageError, match="folder"):
        sombrero.info(tmp_path)
    with pytest.raises(sombrero.SombreroError) as caught:
        sombrero.attack(mesh, "explode:strength=1")
    assert "explode" in str(caught.value)
    with pytest.raises(sombrero.FileError, match="nowhere.obj") as caught:
        sombrero.info("nowhere.obj")
    assert isinstance(caught.value, OSError) and caught.value.kind == "read"
    with pytest.raises(sombrero.SecretError, match="another original"):
        sombrero.detect(suspect, suspect, marked.key)
    with pytest.raises(sombrero.SecretError, match="secret|hexadecimal"):
        sombrero.embed(mesh, secret="1234")
    with pytest.raises(sombrero.CatalogueError):
        sombrero.search(suspect, tmp_path)


def test_files_that_exist_stay_unless_told(file: Path) -> None:
    sombrero.embed(file)
    with pytest.raises(sombrero.FileError, match="force=True"):
        sombrero.embed(file)
    assert sombrero.embed(file, force=True).output.endswith("vase-marked.obj")


def test_names_that_begin_with_a_dash_are_names(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(file.parent)
    file.rename("--json.obj")
    assert sombrero.info("--json.obj").format == "OBJ"


def test_trimesh_round_trip(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed", exc_type=ImportError)
    model = trimesh.Trimesh(*mesh, process=False)
    copy = model.copy()
    copy.vertices = embed(model).points
    assert (copy.vertices == marked.points).all()
    copy.apply_scale(3.0)
    copy.export(tmp_path / "found.glb")
    found = trimesh.load(tmp_path / "found.glb", force="mesh", process=False)
    assert sombrero.detect(found, model, marked.key)
    assert sombrero.detect(tmp_path / "found.glb", model, marked.key)
    with pytest.raises(sombrero.MeshError, match="scene"):
        sombrero.info(trimesh.Scene(model))


def test_open3d_round_trip(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)
    model = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(mesh[0]), open3d.utility.Vector3iVector(mesh[1])
    )
    points = embed(model).points
    assert (points == marked.points).all()
    model.vertices = open3d.utility.Vector3dVector(points)
    open3d.io.write_triangle_mesh(str(tmp_path / "found.ply"), model)
    found = open3d.io.read_triangle_mesh(str(tmp_path / "found.ply"))
    assert sombrero.detect(found, mesh, marked.key)
    assert sombrero.detect(open3d.t.geometry.TriangleMesh.from_legacy(found), mesh, marked.key)


def test_pyvista_round_trip(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed", exc_type=ImportError)
    model = pyvista.PolyData.from_regular_faces(*mesh)
    model.points = embed(model).points
    assert (np.asarray(model.points) == marked.points).all()
    model.save(tmp_path / "found.stl")
    assert sombrero.detect(pyvista.read(tmp_path / "found.stl"), mesh, marked.key)
    with pytest.raises(sombrero.MeshError, match="triangulate"):
        sombrero.info(pyvista.Plane().extrude((0, 0, 1), capping=True))
