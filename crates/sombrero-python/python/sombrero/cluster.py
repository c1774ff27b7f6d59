"""Many suspects on many machines: detect or search over folders of a shared disk.

With Ray (``pip install ray``)::

    from sombrero import cluster

    cluster.detect("suspects", "vase.obj", "vase.key", output="found.jsonl", address="auto")

Each worker prepares the original, or opens the catalogue, once. Answers are lines of JSON, one a suspect, written by the
caller as they come; a run that was broken off is run again, and goes on where it was. Paths have to lead to the same files
on every machine.

Without Ray, ``shard(files, "2/8")`` gives the second of eight machines its share of a list.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ._api import Detector, Searcher
from ._errors import FileError, InternalError, SombreroError, UsageError
from ._key import Key


#: What a mesh's file ends with.
ENDINGS = (".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".3mf")

#: Seconds that a worker gets to end a suspect whose time is over by itself, before it is ended.
GRACE = 20.0

#: Workers that die before they begin, after which a run is given up.
MOST_LOST_EARLY = 20


class Done(NamedTuple):
    """What became of the suspects of a run."""

    answered: int
    """Lines that this run wrote."""
    kept: int
    """Suspects that an earlier run had answered."""
    failed: int
    """Those of ``answered`` that are an error."""
    seconds: float


def files_in(suspects: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> list[str]:
    """The files: of a folder all meshes in it and below it, sorted; else those of the list, each once, in its order."""
    if not isinstance(suspects, (str, os.PathLike)):
        return list(dict.fromkeys(os.fspath(path) for path in suspects))
    root = Path(suspects)
    if not root.is_dir():
        raise FileError(f"{root}: no folder; give a folder, or a list of files", "read")
    return sorted(str(path) for path in root.rglob("*") if path.suffix.lower() in ENDINGS and path.is_file())


def shard(files: Iterable[str | os.PathLike[str]], part: str) -> list[str]:
    """The share ``"i/n"`` of a list, i from 1 to n: by a hash of each path as it is given, whatever else is in the list."""
    try:
        number, count = (int(word) for word in part.split("/"))
    except ValueError:
        number, count = 0, 0
    if not 1 <= number <= count:
        raise UsageError(f"part {part!r}: give I/N with I from 1 to N, such as 2/8")
    paths = (os.fspath(path) for path in files)
    return [path for path in paths if _number(path) % count == number - 1]


def _number(path: str) -> int:
    """The first 64 bits of a hash, the same on every machine."""
    return int.from_bytes(hashlib.sha256(path.encode()).digest()[:8], "big")


def detect(
    suspects: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    original: str | os.PathLike[str],
    key: str | os.PathLike[str] | Key,
    *,
    output: str | os.PathLike[str],
    workers: int | None = None,
    timeout: float = 300.0,
    retries: int = 2,
    address: str | None = None,
    **options: Any,
) -> Done:
    """Detects one mark in many suspects.

    Args:
        suspects: A folder, or a list of files.
        original: The file that was marked, on the shared disk.
        key: Its key. It is sent to the workers.
        output: The file for the answers; what it has already is kept. The fields are those of
            :class:`sombrero.Detection` without ``extracted``, which is as secret as the key; or ``suspect`` and ``error``
            with ``kind`` and ``message``.
        workers: How many, each with one CPU. Default: the CPUs of the cluster.
        timeout: Seconds for one suspect, after which its answer is an error of kind ``timeout``.
        retries: How often a suspect is given to another worker when its own died.
        address: Of the cluster, as ``ray.init`` takes it. Default: the one that runs, or a new one on this machine.
        options: Those of :class:`sombrero.Detector`.
    """
    known = key if isinstance(key, Key) else Key(key)
    place = os.path.abspath(original)
    return _run(suspects, _Detects(place, known, options), output, workers, timeout, retries, address)


def search(
    suspects: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    catalogue: str | os.PathLike[str],
    *,
    output: str | os.PathLike[str],
    workers: int | None = None,
    timeout: float = 300.0,
    retries: int = 2,
    address: str | None = None,
    **options: Any,
) -> Done:
    """Searches a catalogue on the shared disk for the originals of many suspects. ``options`` are those of
    :class:`sombrero.Searcher`, other arguments those of :func:`detect`."""
    place = os.path.abspath(catalogue)
    return _run(suspects, _Searches(place, options), output, workers, timeout, retries, address)


class _Detects:
    """What a worker is to do, sent to it."""

    def __init__(self, original: str, key: Key, options: dict[str, Any]) -> None:
        self.original, self.key, self.options = original, key, options

    def __call__(self) -> Callable[..., Any]:
        return Detector(self.original, self.key, threads=1, **self.options).detect


class _Searches:
    def __init__(self, catalogue: str, options: dict[str, Any]) -> None:
        self.catalogue, self.options = catalogue, options

    def __call__(self) -> Callable[..., Any]:
        return Searcher(self.catalogue, threads=1, **self.options).search


class _Late(Exception):
    """The time of a suspect is over."""


class _Worker:
    """One process that looks at suspects."""

    def __init__(self, job: Callable[[], Callable[..., Any]]) -> None:
        self.job = job

    def ready(self) -> None:
        """Prepares what is done once; comes back when the worker is there."""
        self.look = self.job()

    def answer(self, suspect: str, timeout: float) -> dict[str, Any]:
        end = time.monotonic() + timeout

        def watch(stage: str, done: int, of: int) -> None:
            if time.monotonic() > end:
                raise _Late

        try:
            fields: dict[str, Any] = self.look(suspect, threads=1, progress=watch).to_dict()
        except _Late:
            return _error(suspect, "timeout", f"not done in {timeout:g} s; give more, or look at it by itself")
        except SombreroError as error:
            return _error(suspect, error.kind, str(error))
        fields.pop("extracted", None)
        return {**fields, "suspect": suspect}


def _error(suspect: str, kind: str, message: str) -> dict[str, Any]:
    return {"suspect": suspect, "error": {"kind": kind, "message": message}}


class _Lines:
    """The file of answers."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.answered: set[str] = set()
        whole = 0
        if self.path.exists():
            for line in self.path.read_bytes().splitlines(keepends=True):
                # The last line of a run that was broken off may be the beginning of one.
                if not line.endswith(b"\n"):
                    break
                try:
                    self.answered.add(json.loads(line)["suspect"])
                except (ValueError, KeyError, TypeError):
                    message = f"{self.path}: line {len(self.answered) + 1} is no answer; give another file for them"
                    raise FileError(message, "write") from None
                whole += len(line)
        self.file = self.path.open("r+b" if self.path.exists() else "wb")
        self.file.truncate(whole)
        self.file.seek(whole)

    def add(self, answer: dict[str, Any]) -> bool:
        """Writes an answer unless its suspect has one; gives whether it did."""
        if answer["suspect"] in self.answered:
            return False
        self.answered.add(answer["suspect"])
        self.file.write(json.dumps(answer).encode() + b"\n")
        self.file.flush()
        return True


def _run(
    suspects: Any,
    job: Callable[[], Callable[..., Any]],
    output: str | os.PathLike[str],
    workers: int | None,
    timeout: float,
    retries: int,
    address: str | None,
) -> Done:
    try:
        import ray
    except ImportError:
        raise UsageError("Ray is not installed: pip install ray, or share files by `shard`") from None
    start = time.monotonic()
    names = [os.path.abspath(path) for path in files_in(suspects)]
    lines = _Lines(output)
    waiting = deque(name for name in names if name not in lines.answered)
    kept = len(names) - len(waiting)
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False, include_dashboard=False)
    cluster: Any = ray
    count = workers or max(1, int(cluster.cluster_resources().get("CPU", 1)))
    pool = _Pool(cluster, job, min(count, max(1, len(waiting))), timeout, retries)
    answered = failed = 0
    try:
        for answer in pool.answers(waiting):
            if lines.add(answer):
                answered += 1
                failed += "error" in answer
    finally:
        lines.file.close()
        pool.end()
    return Done(answered, kept, failed, time.monotonic() - start)


class _Pool:
    """Workers, each with one suspect at a time. One that dies is replaced, and its suspect goes back to the queue."""

    def __init__(self, ray: Any, job: Callable[[], Callable[..., Any]], count: int, timeout: float, retries: int) -> None:
        self.ray, self.job, self.timeout, self.retries = ray, ray.put(job), timeout, retries
        self.actor = ray.remote(num_cpus=1, max_restarts=0)(_Worker)
        # What each call is of: its worker, its suspect (None: it only comes up), and when it has to be over.
        self.calls: dict[Any, tuple[Any, str | None, float]] = {}
        self.tries: dict[str, int] = {}
        self.lost_early = 0
        for _ in range(count):
            self.hire()

    def hire(self) -> None:
        worker = self.actor.remote(self.job)
        self.calls[worker.ready.remote()] = (worker, None, float("inf"))

    def answers(self, waiting: deque[str]) -> Iterator[dict[str, Any]]:
        """The answers, as they come."""
        idle: list[Any] = []
        while waiting or any(suspect is not None for _, suspect, _ in self.calls.values()):
            while idle and waiting:
                worker, given = idle.pop(), waiting.popleft()
                call = worker.answer.remote(given, self.timeout)
                self.calls[call] = (worker, given, time.monotonic() + self.timeout + GRACE)
            done, _ = self.ray.wait(list(self.calls), num_returns=1, timeout=1.0)
            for call in done:
                worker, suspect, _ = self.calls.pop(call)
                try:
                    answer = self.ray.get(call)
                except self.ray.exceptions.RayTaskError as error:
                    if suspect is None:
                        # The job itself cannot be begun: no worker will do better.
                        raise error.cause if isinstance(error.cause, SombreroError) else error from None
                    answer = _error(suspect, "internal", f"its worker failed: {error.cause!r}")
                except self.ray.exceptions.RayError as error:
                    self.lost_early += suspect is None
                    if self.lost_early > MOST_LOST_EARLY:
                        raise InternalError(f"workers die before they begin: {error}", "internal") from None
                    yield from self.lost(suspect, waiting)
                    self.hire()
                    continue
                idle.append(worker)
                if suspect is not None:
                    yield answer
            for call, (worker, suspect, end) in list(self.calls.items()):
                if time.monotonic() > end and suspect is not None:
                    del self.calls[call]
                    self.ray.kill(worker)
                    yield _error(suspect, "timeout", f"not done in {self.timeout:g} s, and its worker had to be ended")
                    self.hire()

    def lost(self, suspect: str | None, waiting: deque[str]) -> Iterator[dict[str, Any]]:
        """Gives back the suspect of a worker that died, or its answer if that has happened too often."""
        if suspect is None:
            return
        self.tries[suspect] = self.tries.get(suspect, 0) + 1
        if self.tries[suspect] > self.retries:
            yield _error(suspect, "worker", f"its worker died {self.tries[suspect]} times; look at it by itself")
        else:
            waiting.append(suspect)

    def end(self) -> None:
        for worker, _, _ in self.calls.values():
            self.ray.kill(worker)
