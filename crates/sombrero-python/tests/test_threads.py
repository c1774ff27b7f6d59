"""Threads, progress, and ways to end a call before it is over."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

import sombrero


def test_two_threads_of_python_are_inside_at_once(mesh: Any) -> None:
    # Each waits within its own call for the other to be within its: one after the other they would wait for ever.
    both = threading.Barrier(2, timeout=60)
    met = [False, False]

    def work(which: int) -> sombrero.Embedding:
        def meet(stage: str, done: int, of: int) -> None:
            if not met[which]:
                met[which] = True
                both.wait()

        return sombrero.embed(mesh, secret=b"1" * 32, threads=1, progress=meet)

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(work, range(2))
    assert met == [True, True] and (first.points == second.points).all()


def test_python_goes_on_while_a_call_computes(mesh: Any) -> None:
    ticks, done = 0, threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    sombrero.embed(mesh, threads=1)
    done.set()
    counter.join()
    assert ticks > 5


def test_one_detector_serves_many_threads(mesh: Any, marked: sombrero.Embedding) -> None:
    detector = sombrero.Detector(mesh, marked.key)
    suspects = [(marked.points * scale, mesh[1]) for scale in (1.0, 2.0, 3.0)] + [mesh]
    alone = [sombrero.detect(suspect, mesh, marked.key).log10_p for suspect in suspects]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(detector.detect, suspects))
    assert [one.log10_p for one in found] == alone
    assert [bool(one) for one in found] == [True, True, True, False]


def test_the_number_of_threads_changes_nothing(mesh: Any, marked: sombrero.Embedding) -> None:
    for threads in (1, 3):
        again = sombrero.embed(mesh, owner="A. Museum", recipient="no. 7", secret="0123456789abcdef" * 4, threads=threads)
        assert (again.points == marked.points).all() and again.key == marked.key


def test_progress_is_told_stage_by_stage(mesh: Any) -> None:
    heard: list[tuple[str, int, int]] = []
    sombrero.embed(mesh, progress=lambda *said: heard.append(said))
    stages = [stage for stage, _, of in heard if of == 0]
    assert {"weld", "basis", "insert", "read back", "test"} <= set(stages)
    counted = [(done, of) for _, done, of in heard if of]
    assert counted and all(0 < done <= of for done, of in counted)


def test_what_a_callback_raises_ends_the_call(mesh: Any, marked: sombrero.Embedding) -> None:
    class Enough(Exception):
        pass

    def stop(stage: str, done: int, of: int) -> None:
        raise Enough(stage)

    with pytest.raises(Enough):
        sombrero.embed(mesh, progress=stop)
    with pytest.raises(Enough):
        sombrero.detect((marked.points * 2, mesh[1]), mesh, marked.key, progress=stop)
    assert sombrero.detect((marked.points, mesh[1]), mesh, marked.key), "the next call is as good as ever"


@pytest.mark.skipif(os.name != "posix", reason="signals are sent otherwise here")
def test_an_interrupt_ends_the_call() -> None:
    # In the background of a script, interrupts may be ignored from the start.
    script = (
        "import os, signal, sombrero\n"
        "from shapes import vase\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "sent = []\n"
        "def tell(*said):\n"
        "    if not sent:\n"
        "        sent.append(os.kill(os.getpid(), signal.SIGINT))\n"
        "try:\n    sombrero.embed(vase(120, 90), progress=tell)\nexcept KeyboardInterrupt:\n    print('ended')\n"
    )
    path = os.pathsep.join(sys.path)
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": path}, capture_output=True, check=False
    )
    assert done.stdout.strip() == b"ended", done.stderr.decode()
    assert done.returncode == 0
