"""Answers, keys and the detector as Python has them."""

from __future__ import annotations

import json
import os
import pickle
import stat
from pathlib import Path
from typing import Any

import pytest

import sombrero


def test_answers_are_fixed_and_tell_what_they_have(mesh: Any) -> None:
    info = sombrero.info(mesh)
    assert info.triangles == len(mesh[1]) == info["triangles"] == info.to_dict()["triangles"]
    assert len(info.bounding_box.min) == 3 and info.genus == 0
    assert json.loads(info.to_json()) == json.loads(json.dumps(json.loads(info.to_json())))
    assert "triangles" in dir(info) and "markable=True" in repr(info)
    with pytest.raises(AttributeError, match="no field 'triangle'"):
        _ = info.triangle
    with pytest.raises(AttributeError, match="cannot be changed"):
        info.triangles = 1
    assert pickle.loads(pickle.dumps(info)) == info


def test_a_verdict_is_a_condition(mesh: Any, marked: sombrero.Embedding) -> None:
    assert not sombrero.detect(mesh, mesh, marked.key)
    assert sombrero.detect((marked.points, mesh[1]), mesh, marked.key)
    assert sombrero.verify(marked.key, mesh).genuine


def test_keys_keep_their_secret(marked: sombrero.Embedding, tmp_path: Path) -> None:
    key = marked.key
    assert repr(key) == "Key(owner='A. Museum', recipient='no. 7')"
    secret = json.loads(key.content)["secret"]
    assert secret not in repr(marked) + str(key) + marked.to_json()
    key.save(tmp_path / "vase.key")
    assert sombrero.Key(tmp_path / "vase.key") == key == pickle.loads(pickle.dumps(key))
    if os.name == "posix":
        assert stat.S_IMODE((tmp_path / "vase.key").stat().st_mode) == 0o600
    with pytest.raises(sombrero.FileError, match="force"):
        key.save(tmp_path / "vase.key")
    key.save(tmp_path / "vase.key", force=True)
    with pytest.raises(sombrero.SecretError):
        sombrero.Key(b"{}")
    with pytest.raises(sombrero.FileError):
        sombrero.Key(tmp_path / "none.key")


def test_a_key_of_arrays_goes_to_a_file_if_one_is_named(mesh: Any, tmp_path: Path) -> None:
    answer = sombrero.embed(mesh, key=tmp_path / "vase.key")
    assert answer.key == str(tmp_path / "vase.key")
    assert sombrero.detect((answer.points, mesh[1]), mesh, answer.key)


def test_a_report_of_arrays(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    page = tmp_path / "found.html"
    found = sombrero.detect((marked.points, mesh[1]), mesh, marked.key, report=page)
    assert found.report == str(page) and page.read_text().startswith("<!DOCTYPE html>")


def test_trace_and_search_take_keys_in_memory(mesh: Any, marked: sombrero.Embedding, tmp_path: Path) -> None:
    others = [sombrero.embed(mesh, recipient=f"no. {number}").key for number in (8, 9)]
    suspect = (marked.points, mesh[1])
    trace = sombrero.trace(suspect, mesh, [*others, marked.key])
    assert trace and trace.recipients[0].recipient == "no. 7" and trace.recipients[0].key == "<keys>/000002"
    assert trace.keys == 3
    original = tmp_path / "vase.ply"
    original.write_bytes(sombrero.to_ply(mesh))
    sombrero.command("catalogue", "add", str(tmp_path / "models"), str(original))
    assert sombrero.search(suspect, tmp_path / "models").candidates[0].original == "vase.ply"
    found = sombrero.search(suspect, tmp_path / "models", keys=[*others, marked.key])
    assert found and found.candidates[0].recipient == "no. 7"
    searcher = sombrero.Searcher(tmp_path / "models", keys=[*others, marked.key])
    assert searcher.search(suspect).candidates == found.candidates


def test_exceptions_survive_pickling() -> None:
    with pytest.raises(sombrero.FileError) as caught:
        sombrero.info("nowhere.obj")
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is sombrero.FileError and str(again) == str(caught.value) and again.kind == "read"
