"""The Blender extension as far as it can be tested without Blender; `blender/tests` has the rest."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import sombrero

PACKAGE = Path(__file__).parent.parent
EXTENSION = PACKAGE / "blender"
CODE = sorted(EXTENSION.glob("*.py"))


def module(name: str) -> ModuleType:
    """A module of the extension that needs no Blender."""
    spec = importlib.util.spec_from_file_location(f"extension_{name}", EXTENSION / f"{name}.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


places, words, work = module("places"), module("words"), module("work")


def test_the_manifest_has_what_blender_asks_for() -> None:
    tomllib = pytest.importorskip("tomllib", reason="Python 3.11 reads TOML")
    manifest = tomllib.loads((EXTENSION / "blender_manifest.toml").read_text())
    workspace = tomllib.loads((PACKAGE.parent.parent / "Cargo.toml").read_text())
    assert manifest["version"] == workspace["workspace"]["package"]["version"]
    assert manifest["schema_version"] == "1.0.0" and manifest["blender_version_min"] == "4.2.0"
    assert (manifest["id"], manifest["type"]) == ("sombrero", "add-on")
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["name"] and manifest["maintainer"] and re.fullmatch(r"\d{4} .+", manifest["copyright"][0])
    assert list(manifest["permissions"]) == ["files"], "no network"
    for text in (manifest["tagline"], manifest["permissions"]["files"]):
        assert 0 < len(text) <= 64 and text[-1].isalnum()
    assert not {"wheels", "platforms"} & set(manifest), "they are added when it is packed"


def test_the_licence_is_there_and_every_file_names_it() -> None:
    assert "Version 3, 29 June 2007" in (EXTENSION / "LICENSE").read_text()
    for path in CODE:
        assert path.read_text().splitlines()[1] == "# SPDX-License-Identifier: GPL-3.0-or-later", path.name


@pytest.mark.parametrize("path", CODE, ids=lambda path: path.name)
def test_the_code_evaluates_no_text_and_knows_no_network(path: Path) -> None:
    names, imports = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Name):
            names.add(node.id)
        elif isinstance(node, ast.Import):
            imports |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            imports.add(str(node.module).partition(".")[0])
    assert not names & {"eval", "exec", "compile", "__import__"}
    known = {"__future__", "collections", "contextlib", "filecmp", "math", "pathlib", "shutil", "textwrap", "threading"}
    assert imports <= known | {"typing", "webbrowser", "bpy", "sombrero"}, "a new import; does it stay off the network?"


def test_no_original_or_key_is_ever_replaced(tmp_path: Path) -> None:
    copy = places.copy_named(str(tmp_path / "vase"))
    assert copy == tmp_path / "vase.glb"
    folders = [places.secret_folder(copy, "") for _ in range(3)]
    assert [folder.name for folder in folders] == ["vase-secret", "vase-secret-2", "vase-secret-3"]
    elsewhere = places.secret_folder(copy, str(tmp_path / "safe"))
    assert elsewhere == tmp_path / "safe" / "vase-secret"
    assert places.copies_folder(copy, folders[1] / "vase.glb") == tmp_path / "vase-copies-2"


def test_what_was_exported_before_is_known_by_its_bytes(tmp_path: Path) -> None:
    copy = tmp_path / "vase[1].glb"
    old, other, new = (places.secret_folder(copy, "") / copy.name for _ in range(3))
    old.write_bytes(b"a scene")
    other.write_bytes(b"another")
    new.write_bytes(b"a scene")
    assert places.same_as_before(new, "", copy) == old
    new.write_bytes(b"a third")
    assert places.same_as_before(new, "", copy) is None


def test_names_of_objects_become_names_of_files(tmp_path: Path) -> None:
    assert places.fresh_file(tmp_path, "../a/b: c", (".glb",)) == tmp_path / "_a_b_ c"
    (tmp_path / "vase.html").touch()
    assert places.fresh_file(tmp_path, "vase", (".glb", ".html")) == tmp_path / "vase-2"


@pytest.mark.parametrize(
    ("name", "cure"),
    [("", "give one"), ("vase.fbx", "choose one of these"), ("/nowhere/at/all/vase.glb", "choose another")],
)
def test_a_file_that_cannot_be_says_why(name: str, cure: str) -> None:
    with pytest.raises(places.Unusable, match=cure):
        places.copy_named(name)


def test_work_is_done_elsewhere_and_tells_how_far_it_is(file: Path) -> None:
    task = work.Work(lambda progress: sombrero.embed(file, progress=progress))
    work.begin(task)
    assert work.current is task
    while not task.is_over(0.05):
        pass
    work.forget()
    assert work.current is None and task.progress[0]
    assert task.result().output == str(file.with_stem("vase-marked"))


def test_cancelled_work_ends_and_tidies_up(file: Path) -> None:
    tidied = []
    task = work.Work(lambda progress: sombrero.embed(file, progress=progress), lambda: tidied.append(True))
    task.cancel()
    work.begin(task)
    work.end()
    with pytest.raises(work.Cancelled):
        task.result()
    assert tidied == [True] and list(file.parent.iterdir()) == [file], "the engine leaves nothing half-made"


def test_answers_in_words(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    original = tmp_path / "vase-secret" / "vase.glb"
    lines = words.marked(marked, tmp_path / "vase.glb", original.parent)
    assert lines[:2] == [
        "Marked: publish vase.glb",
        "Keep the folder vase-secret secret and as it is: nothing is found without it",
    ]
    found = words.checked(sombrero.detect((marked.points, mesh[1]), mesh, marked.key), "Vase.001", original)
    assert found[0] == "Found: Vase.001 carries the mark of vase.glb"
    assert any(re.fullmatch(r"An unmarked model matches as well once in 10\^\d+ times", line) for line in found)
    assert "That convinces anybody" in found and "100 % of the original is there" in found
    lost = words.checked(sombrero.detect(mesh, mesh, marked.key), "Vase.001", original)
    assert lost[0] == "Not found: no mark of vase.glb in Vase.001"
    named = words.traced(sombrero.trace((marked.points, mesh[1]), mesh, [marked.key]), "Vase.001")
    assert named[0] == "Named: Vase.001 is the copy of no. 7"
    nobody = words.traced(sombrero.trace(mesh, mesh, [marked.key]), "Vase.001")
    assert nobody[0] == "Nobody is named: Vase.001 is not a copy of these 1 keys"


def test_errors_speak_of_what_is_seen(tmp_path: Path) -> None:
    cube = tmp_path / "cube.obj"
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    cube.write_text(corners + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n")
    with pytest.raises(sombrero.MeshError) as refused:
        sombrero.embed(cube)
    said = words.error(refused.value, cube)
    assert said.startswith("What was exported: the mesh can carry") and "finer mesh" in said
    assert words.error(ValueError("a.key: exists; choose another folder or give force=True")) == (
        "a.key: exists; choose another folder or file name"
    )
    assert words.share(1, 0) == 0.0 and words.share(3, 4) == 0.75 and words.stage("weld") == "Joining seams"
