"""Many suspects on many machines."""

from __future__ import annotations

import json
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sombrero
from conftest import SECRET
from shapes import vase
from sombrero import cluster


def test_shares_of_a_list_are_all_of_it_and_each_once(tmp_path: Path) -> None:
    files = [f"suspects/{number}.obj" for number in range(100)]
    shares = [cluster.shard(files, f"{part}/3") for part in (1, 2, 3)]
    assert sorted(sum(shares, [])) == sorted(files) and all(20 < len(share) < 50 for share in shares)
    # A file stays where it is, whatever else there is.
    assert cluster.shard(files[::2], "2/3") == [file for file in shares[1] if file in files[::2]]
    for wrong in ("0/3", "4/3", "3", "a/b", "1/0"):
        with pytest.raises(sombrero.UsageError):
            cluster.shard(files, wrong)
    with pytest.raises(sombrero.FileError):
        cluster.files_in(tmp_path / "none")


def test_a_broken_line_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "found.jsonl"
    path.write_bytes(b'{"suspect": "a"}\n{"suspect": "b", "dete')
    lines = cluster._Lines(path)
    assert lines.answered == {"a"}
    assert lines.add({"suspect": "b"}) and not lines.add({"suspect": "a"})
    lines.file.close()
    assert [json.loads(line)["suspect"] for line in path.read_text().splitlines()] == ["a", "b"]


@pytest.fixture(scope="module")
def nodes() -> Iterator[Any]:
    ray = pytest.importorskip("ray", reason="Ray is not installed", exc_type=ImportError)
    utils = pytest.importorskip("ray.cluster_utils", exc_type=ImportError)
    made = utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    second = made.add_node(num_cpus=1)
    ray.init(address=made.address, log_to_driver=False)
    yield made, second
    ray.shutdown()
    made.shutdown()


def test_every_file_is_answered_once_though_a_node_is_killed(nodes: Any, tmp_path: Path) -> None:
    made, second = nodes
    mesh = vase(24, 20)
    original, key = tmp_path / "vase.ply", tmp_path / "vase.key"
    original.write_bytes(sombrero.to_ply(mesh))
    marked = sombrero.embed(mesh, key=key, secret=SECRET, preset="robust")
    suspects = tmp_path / "suspects"
    suspects.mkdir()
    for number in range(40):
        points = marked.points if number % 2 else mesh[0]
        (suspects / f"{number:02}.ply").write_bytes(sombrero.to_ply((points * (1.0 + number), mesh[1])))
    (suspects / "broken.obj").write_text("v 0 0 nowhere\n")
    output = tmp_path / "found.jsonl"

    def kill() -> None:
        while not output.exists() or output.read_bytes().count(b"\n") < 15:
            time.sleep(0.05)
        made.remove_node(second, allow_graceful=False)

    killer = threading.Thread(target=kill)
    killer.start()
    done = cluster.detect(suspects, original, key, output=output, workers=2)
    killer.join()
    answers = [json.loads(line) for line in output.read_text().splitlines()]
    assert done.answered == 41 and done.failed == 1
    assert set(Counter(answer["suspect"] for answer in answers).values()) == {1} and len(answers) == 41
    verdicts = {Path(answer["suspect"]).stem: answer.get("detected") for answer in answers}
    assert all(verdicts[f"{number:02}"] == bool(number % 2) for number in range(40))
    assert verdicts["broken"] is None and "extracted" not in answers[0]
    # Once more: nothing is left to do.
    again = cluster.detect(suspects, original, key, output=output, workers=1)
    assert again.answered == 0 and again.kept == 41
    assert np.isfinite([answer["log10_p"] for answer in answers if "log10_p" in answer]).all()
