"""The functions: each is one command, on files or on arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from . import _native
from ._answers import Attacked, Comparison, Detection, Embedding, Info, Search, Trace, Verification
from ._call import Call, Progress, named
from ._errors import UsageError
from ._key import Key
from ._mesh import MeshLike, arrays_of



def embed(
    mesh: MeshLike,
    output: str | os.PathLike[str] | None = None,
    key: str | os.PathLike[str] | None = None,
    *,
    owner: str = "",
    recipient: str = "",
    preset: str | None = None,
    coefficients: int | None = None,
    epsilon: float | None = None,
    max_displacement: float | None = None,
    basis: str | None = None,
    secret: str | bytes | None = None,
    recompute_normals: bool = False,
    decimals: int | None = None,
    catalogue: str | os.PathLike[str] | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Embedding:
    """Marks a mesh: a copy with invisible changes, and the secret key that finds them again.

    Keep the original exactly as it is, and the key, both secret. Of arrays that is :func:`to_ply` of them: what is
    detected against has to have the same numbers in the same order.

    Args:
        mesh: A mesh file, of which every byte but positions is kept; or arrays, see :data:`MeshLike`.
        output: The marked copy. Default: INPUT-marked beside the input. Arrays are given back as ``points``.
        key: The key to write. Default: INPUT.key beside the input; of arrays a :class:`Key` is given back as ``key``.
        owner: Whose mark it is. It becomes part of the mark.
        recipient: Whose copy it is.
        preset: ``"faithful"`` (default: nobody sees it), ``"robust"`` (survives more, seen on flats) or ``"paper"``.
        coefficients: How many carry the mark. Default: the preset's, or fewer on a small mesh.
        epsilon: Strength of the mark, 0.0038 by default with ``"faithful"``.
        max_displacement: What no vertex moves by more than, in model units.
        basis: ``"sombrero"``, ``"derby"`` or ``"hat"``, of the presets robust and paper.
        secret: 32 bytes or 64 hexadecimal digits. Default: the environment's SOMBRERO_SECRET, else a new one from the
            operating system.
        recompute_normals: Turn stored normals as the surface turns.
        decimals: Decimals of the coordinates of a text file.
        catalogue: A catalogue that keeps original and key, encrypted; of files only.
        force: Replace files that exist.
        threads: How many to work on; the result does not depend on it. Default: all cores.
        progress: Called as ``progress(stage, done, of)`` from another thread; ``of`` is 0 where it is not known. What it
            raises ends the call.

    Returns:
        ``output`` and ``key`` (paths) of a file; ``points``, float64 ``(n, 3)`` in the order of the vertices, and
        ``key`` of arrays. And how strong and how visible the mark is.

    Raises:
        MeshError: The mesh cannot carry a mark; or a wrong shape, type, index, NaN.
        FileError: A file cannot be read or written, or exists.
        UsageError: An argument makes no sense.
    """
    call = Call("embed")
    is_file = call.mesh(mesh, "mesh")
    if is_file:
        call.options(output=output, key=key, catalogue=catalogue)
    else:
        _only_of_files(output=output, catalogue=catalogue)
        call.out_meshes.append(named("copy"))
        call.option("output", named("copy"))
        call.option("key", named("key") if key is None else key)
        if key is None:
            call.out_files.append(named("key"))
    call.options(
        owner=owner,
        recipient=recipient,
        preset=preset,
        coefficients=coefficients,
        epsilon=epsilon,
        max_displacement=max_displacement,
        basis=basis,
        recompute_normals=recompute_normals,
        decimals=decimals,
        force=force,
    )
    call.secret(secret)
    answers, meshes, files = call.answers(threads, progress)
    fields = answers[0]
    if not is_file:
        del fields["output"]
        fields["points"] = meshes[named("copy")][0]
        if key is None:
            fields["key"] = Key(files[named("key")])
    return Embedding(fields)


class Detector:
    """An original and a key that are read once, for any number of suspects and from any number of threads.

    The basis is computed when the first suspect asks for it. Arguments are those of :func:`detect`.
    """

    __slots__ = ("_native",)

    def __init__(
        self,
        original: MeshLike,
        key: str | os.PathLike[str] | Key,
        *,
        method: str = "robust",
        registration: str = "auto",
        resampling: str = "auto",
        threshold: float = 1e-6,
        budget: float = 60.0,
        seed: int = 0,
        prepared: str | os.PathLike[str] | None = None,
        ca: str | os.PathLike[str] | None = None,
        force: bool = False,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        # What is looked at is said later.
        call = Call("detect", named("suspect"))
        call.mesh(original, "original", "original")
        call.key(key)
        call.options(method=method, registration=registration, resampling=resampling, threshold=threshold)
        call.options(budget=budget, seed=seed, prepared=prepared, ca=ca, force=force)
        self._native = call.standing(threads, progress)

    def detect(
        self,
        suspect: MeshLike,
        *,
        report: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Detection:
        """Looks for the mark in one suspect; see :func:`detect`."""
        call = Call()
        call.mesh(suspect, "suspect")
        return Detection(call.looked(self._native, report, threads, progress))

    def __repr__(self) -> str:
        return "Detector()"


def detect(
    suspect: MeshLike,
    original: MeshLike,
    key: str | os.PathLike[str] | Key,
    *,
    method: str = "robust",
    registration: str = "auto",
    resampling: str = "auto",
    threshold: float = 1e-6,
    budget: float = 60.0,
    seed: int = 0,
    prepared: str | os.PathLike[str] | None = None,
    ca: str | os.PathLike[str] | None = None,
    report: str | os.PathLike[str] | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Detection:
    """Tells whether a suspect carries the mark. For several suspects of one original use a :class:`Detector`.

    Args:
        suspect: The mesh to look at: a file, or arrays.
        original: What was marked, exactly: the same file byte for byte, or the same arrays.
        key: The key that :func:`embed` wrote.
        method: ``"robust"`` or ``"paper"``.
        registration: ``"auto"``, ``"always"`` or ``"never"``: align the suspect first.
        resampling: ``"auto"``, ``"always"`` or ``"never"``: compare surfaces instead of vertices.
        threshold: Found when the chance of an unmarked mesh to match as well is at most this.
        budget: CPU seconds of this process after which the search ends with what it has. Calls that run side by side
            all take from it.
        seed: Seed of the points that resampling draws.
        prepared: A file of ``sombrero prepare``. Default: KEY.prepared where there is one.
        ca: Certificates (PEM) of timestamping authorities that you trust.
        report: An HTML page for people, to be written.
        force: Replace a report that exists.
        threads: As in :func:`embed`.
        progress: As in :func:`embed`.

    Raises:
        SecretError: The key is not genuine, or of another original.
        MeshError: The suspect is no mesh to look at.
        FileError: A file cannot be read or written.
    """
    call = Call("detect")
    call.mesh(suspect, "suspect")
    call.mesh(original, "original", "original")
    call.key(key)
    call.options(method=method, registration=registration, resampling=resampling, threshold=threshold)
    call.options(budget=budget, seed=seed, prepared=prepared, ca=ca, report=report, force=force)
    return Detection(call.answer(threads, progress))


def trace(
    suspect: MeshLike,
    original: MeshLike,
    keys: str | os.PathLike[str] | Iterable[str | os.PathLike[str] | Key],
    *,
    registration: str = "auto",
    resampling: str = "auto",
    threshold: float = 1e-6,
    budget: float = 60.0,
    ca: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Trace:
    """Finds out whose copy a suspect is, among the keys of many copies of one original.

    Args:
        suspect: The mesh to look at.
        original: What was marked, exactly.
        keys: The folder with the keys, or the keys. Then ``recipients`` name them ``<keys>/000000`` and so on, in their
            order.
        threshold: Somebody is named when the chance that anybody without a part matches as well is at most this.

    Other arguments and errors are those of :func:`detect`.
    """
    call = Call("trace")
    call.mesh(suspect, "suspect")
    call.mesh(original, "original", "original")
    call.keys(keys)
    call.options(registration=registration, resampling=resampling, threshold=threshold, budget=budget, ca=ca)
    return Trace(call.answer(threads, progress))


def search(
    suspect: MeshLike,
    catalogue: str | os.PathLike[str],
    *,
    keys: str | os.PathLike[str] | Iterable[str | os.PathLike[str] | Key] | None = None,
    rank_only: bool = False,
    top: int = 10,
    threshold: float = 1e-6,
    passphrase_file: str | os.PathLike[str] | None = None,
    identity: str | os.PathLike[str] | None = None,
    report: str | os.PathLike[str] | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Search:
    """Finds out which original of a catalogue a suspect was made from, and whose copy it is.

    Args:
        suspect: The mesh to look at.
        catalogue: The folder that ``command("catalogue", "add", ...)`` or ``embed(..., catalogue=...)`` made.
        keys: The keys to test. Default: those that the catalogue keeps, opened by the passphrase in ``passphrase_file``,
            else in the environment's SOMBRERO_PASSPHRASE, or by the age ``identity`` in a file.
        rank_only: Only rank the originals by shape.
        top: How many originals to rank and test.
        threshold: Found when the chance of any accidental match in this search is at most this.
        report: An HTML page with the candidates; the report of the best goes beside it.

    Other arguments are those of :func:`detect`.

    Raises:
        CatalogueError: The catalogue cannot be used or opened.
    """
    call = Call("search")
    call.mesh(suspect, "suspect")
    call.option("catalogue", catalogue)
    call.keys(keys)
    call.options(rank_only=rank_only, top=top, threshold=threshold, report=report, force=force)
    call.options(passphrase_file=passphrase_file, identity=identity)
    return Search(call.answer(threads, progress))


class Searcher:
    """A catalogue that is opened once, for any number of suspects and from any number of threads.

    Arguments are those of :func:`search`.
    """

    __slots__ = ("_native",)

    def __init__(
        self,
        catalogue: str | os.PathLike[str],
        *,
        keys: str | os.PathLike[str] | Iterable[str | os.PathLike[str] | Key] | None = None,
        rank_only: bool = False,
        top: int = 10,
        threshold: float = 1e-6,
        passphrase_file: str | os.PathLike[str] | None = None,
        identity: str | os.PathLike[str] | None = None,
        force: bool = False,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        call = Call("search", named("suspect"))
        call.option("catalogue", catalogue)
        call.keys(keys)
        call.options(rank_only=rank_only, top=top, threshold=threshold, force=force)
        call.options(passphrase_file=passphrase_file, identity=identity)
        self._native = call.standing(threads, progress)

    def search(
        self,
        suspect: MeshLike,
        *,
        report: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Search:
        """Looks for the original of one suspect; see :func:`search`."""
        call = Call()
        call.mesh(suspect, "suspect")
        return Search(call.looked(self._native, report, threads, progress))

    def __repr__(self) -> str:
        return "Searcher()"


def info(mesh: MeshLike, *, threads: int | None = None, progress: Progress | None = None) -> Info:
    """Says what a mesh is: counts, topology, size, what is odd about it, and whether it can be marked."""
    call = Call("info")
    call.mesh(mesh, "mesh")
    return Info(call.answer(threads, progress))


def compare(
    a: MeshLike, b: MeshLike, *, threads: int | None = None, progress: Progress | None = None
) -> Comparison:
    """Measures how far two meshes are apart, as they stand. Relative lengths are shares of the largest side of ``a``."""
    call = Call("compare")
    call.mesh(a, "a")
    call.mesh(b, "b")
    return Comparison(call.answer(threads, progress))


def attack(
    mesh: MeshLike,
    attacks: str | Iterable[str],
    output: str | os.PathLike[str] | None = None,
    *,
    seed: int = 0,
    force: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Attacked:
    """Applies attacks, to see what a mark survives.

    Args:
        mesh: The mesh to attack; it stays as it is.
        attacks: One text such as ``"noise:amplitude=0.002 smooth:iterations=10"``, or one for each attack, in order.
            ``sombrero attack --help`` lists them. Lengths are shares of the largest side.
        output: The attacked mesh, of a file. Arrays are given back as ``points`` and ``triangles``.
        seed: Seed of everything random.
        force: Replace an output that exists.
    """
    call = Call("attack")
    if call.mesh(mesh, "mesh"):
        if output is None:
            raise UsageError("output: an attacked file needs a name")
        call.option("output", output)
    else:
        _only_of_files(output=output)
        call.out_meshes.append(named("attacked"))
        call.option("output", named("attacked"))
    call.words.extend(attacks.split() if isinstance(attacks, str) else attacks)
    call.options(seed=seed, force=force)
    answers, meshes, _ = call.answers(threads, progress)
    fields = answers[0]
    if meshes:
        del fields["output"]
        fields["points"], fields["triangles"] = meshes[named("attacked")]
    return Attacked(fields)


def verify(
    key: str | os.PathLike[str] | Key,
    original: MeshLike,
    *,
    ca: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Verification:
    """Derives watermark and basis again from the original, and says whether the key is genuine.

    Raises:
        SecretError: It is not, or it is of another original.
    """
    call = Call("verify")
    call.key_file(key)
    call.mesh(original, "original", "original")
    call.option("ca", ca)
    return Verification(call.answer(threads, progress))


def to_ply(mesh: MeshLike) -> bytes:
    """The file that arrays stand for: binary PLY with 64-bit coordinates, vertices and triangles in their order.

    The command treats this file exactly as this package treats the arrays: same key, same mark, to the bit. Keep it as the
    original of what was marked as arrays.
    """
    vertices, faces = arrays_of(mesh, "mesh")
    return _native.ply(vertices, faces, "mesh")


def _only_of_files(**given: Any) -> None:
    for name, value in given.items():
        if value is not None:
            raise UsageError(f"{name}: of arrays the answer has arrays; give a file, or write them yourself")
