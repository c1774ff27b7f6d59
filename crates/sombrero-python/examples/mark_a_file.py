"""Mark a file, publish the copy, and find the mark in what somebody made of it."""

import tempfile
from pathlib import Path

import sombrero
from shapes import vase, write_obj

folder = Path(tempfile.mkdtemp())
original = write_obj(folder / "vase.obj", *vase())

# The copy to publish, and the key to keep with the original. Every byte but the positions is the original's.
marked = sombrero.embed(original, owner="A. Museum")
print(f"{marked.output}: moved by {100 * marked.distortion.relative_max:.2f} % of its size at most")

# Somebody turns, scales, distorts and simplifies it.
found = folder / "found.obj"
sombrero.attack(marked.output, "transform noise:amplitude=0.002 simplify:ratio=0.6", found, seed=7)

detection = sombrero.detect(found, original, marked.key, report=folder / "found.html")
print(f"found: {detection.detected}, log10 p = {detection.log10_p:.1f}, report: {detection.report}")
assert detection and not sombrero.detect(original, original, marked.key)
