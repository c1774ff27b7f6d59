"""Whatever the package does is what the command does, to the bit."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sombrero
from conftest import SECRET

# The command of the package, or, where one is named, of another build.
COMMAND = os.environ.get("SOMBRERO_COMMAND") or shutil.which("sombrero", path=str(Path(sys.executable).parent))

if COMMAND is None:
    pytest.skip("the command of the package is not installed beside this interpreter", allow_module_level=True)


def run(*arguments: str | Path) -> dict[str, Any]:
    """What the command answers, in a process of its own."""
    environment = {**os.environ, "SOMBRERO_SECRET": SECRET}
    done = subprocess.run([COMMAND, *map(str, arguments), "--json"], capture_output=True, env=environment, check=False)
    assert done.returncode in (0, 1), done.stdout.decode() + done.stderr.decode()
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def timeless(answer: Any, *names: str) -> dict[str, Any]:
    """An answer without what differs from run to run, or is called otherwise in memory."""
    fields = json.loads(answer.to_json()) if isinstance(answer, sombrero.Answer) else dict(answer)
    return {name: value for name, value in fields.items() if name not in ("seconds", *names)}


def test_files_are_the_same_byte_for_byte(file: Path, tmp_path: Path) -> None:
    theirs, ours = tmp_path / "theirs.obj", tmp_path / "ours.obj"
    said = run("embed", file, "-o", theirs, "--key", tmp_path / "theirs.key", "--owner", "A. Museum")
    answer = sombrero.embed(file, ours, tmp_path / "ours.key", owner="A. Museum", secret=SECRET)
    assert ours.read_bytes() == theirs.read_bytes() != file.read_bytes()
    assert (tmp_path / "ours.key").read_bytes() == (tmp_path / "theirs.key").read_bytes()
    assert timeless(answer, "output", "key") == timeless(said, "output", "key")


def test_arrays_are_the_file_that_they_stand_for(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    original, copy, key = tmp_path / "vase.ply", tmp_path / "copy.ply", tmp_path / "vase.key"
    original.write_bytes(sombrero.to_ply(mesh))
    run("embed", original, "-o", copy, "--key", key, "--owner", "A. Museum", "--recipient", "no. 7")
    assert key.read_bytes() == marked.key.content
    assert copy.read_bytes() == sombrero.to_ply((marked.points, mesh[1]))
    # What is found is found by either, whatever is a file and whatever an array.
    by_command = timeless(run("detect", copy, "--original", original, "--key", key), "suspect", "files")
    arrays = (marked.points, mesh[1])
    for suspect, originally, secret in ((copy, original, key), (arrays, mesh, marked.key), (copy, mesh, key)):
        found = sombrero.detect(suspect, originally, secret)
        assert found and timeless(found, "suspect", "files") == by_command


def test_the_file_of_arrays_stays_the_same_in_all_versions(mesh: Any) -> None:
    tetrahedron = (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.1]]), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    digest = hashlib.sha256(sombrero.to_ply(tetrahedron)).hexdigest()
    # Keys of arrays are bound to these bytes: another digest here makes all of them useless.
    assert digest == "c2f13318f525892b23e3ef371397550bbce39458085c4594d99bbf916d59919d"


def test_other_commands_answer_alike(file: Path, tmp_path: Path) -> None:
    attacks = ["noise:amplitude=0.003", "simplify:ratio=0.7"]
    theirs = run("attack", file, "-o", tmp_path / "theirs.obj", "--seed", "5", *attacks)
    ours = sombrero.attack(file, attacks, tmp_path / "ours.obj", seed=5)
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    assert timeless(ours, "output") == timeless(theirs, "output")
    assert timeless(sombrero.info(file)) == run("info", file)
    assert timeless(sombrero.compare(file, ours.output)) == run("compare", file, tmp_path / "theirs.obj")


def test_the_command_has_the_exit_status_and_the_words_of_the_command(file: Path, tmp_path: Path) -> None:
    done = subprocess.run([COMMAND, "info", str(file)], capture_output=True, check=False)
    assert done.returncode == 0 and done.stdout.decode().startswith(f"{file}: OBJ")
    done = subprocess.run([COMMAND, "info", str(tmp_path / "nothing.obj")], capture_output=True, check=False)
    assert done.returncode == 2 and b"nothing.obj" in done.stderr
    done = subprocess.run([COMMAND, "--help"], capture_output=True, check=False)
    assert done.returncode == 0 and b"Usage: sombrero" in done.stdout


def test_any_command_can_be_called(file: Path, tmp_path: Path) -> None:
    buyers = tmp_path / "buyers.csv"
    buyers.write_text("recipient\norder 1\norder 2\n")
    copies = tmp_path / "copies"
    [made] = sombrero.command("embed", str(file), "--recipients", str(buyers), "--out-dir", str(copies))
    assert made.written == 2
    leaked = sorted(copies.glob("*.obj"))[1]
    trace = sombrero.trace(leaked, file, copies / "keys")
    assert trace and trace.recipients[0].recipient == "order 2"
    # Of several files each has an answer, one that failed too.
    (copies / "broken.obj").write_text("v 0 0 nowhere\n")
    key = sorted((copies / "keys").glob("*.key"))[0]
    answers = sombrero.command("detect", str(copies), "--original", str(file), "--key", str(key))
    assert answers[-1].summary.files == 3 and answers[-1].summary.found == 1
    assert [answer.error.kind for answer in answers if "error" in answer] == ["read"]
