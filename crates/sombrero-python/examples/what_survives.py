"""What a mark of your model survives: one detector, many attacks, several threads."""

from concurrent.futures import ThreadPoolExecutor

import sombrero
from shapes import vase

original = vase()
faces = original[1]


def show(stage: str, done: int, of: int) -> None:
    """Progress; to raise here ends the call."""
    if done == of > 0:
        print(f"  {stage}: done")


marked = sombrero.embed(original, progress=show)
detector = sombrero.Detector(original, marked.key)

ATTACKS = [
    "none",
    "noise:amplitude=0.002",
    "noise:amplitude=0.007",
    "smooth:iterations=10",
    "simplify:ratio=0.5",
    "reorder crop:fraction=0.5",
]


def survives(attack: str) -> sombrero.Detection:
    """What is found after an attack."""
    left = sombrero.attack((marked.points, faces), attack, threads=1)
    return detector.detect((left.points, left.triangles), threads=1)


# The interpreter is free while sombrero computes: two calls run side by side.
with ThreadPoolExecutor(2) as pool:
    for attack, found in zip(ATTACKS, pool.map(survives, ATTACKS)):
        print(f"{attack:32} log10 p = {found.log10_p:7.1f}  {'found' if found else '-'}")
        assert found, "all of these are weak enough for this model"
