"""A catalogue of your models: which of them was a suspect made from, and whose copy is it?"""

import os
import tempfile
from pathlib import Path

import sombrero
from shapes import vase, write_obj

folder = Path(tempfile.mkdtemp())
catalogue = folder / "models"
# A passphrase of your own; a file (passphrase_file=) does as well, and at a terminal you are asked.
os.environ["SOMBRERO_PASSPHRASE"] = "several random words are long enough"

# Three models, each marked for somebody. The catalogue keeps originals and keys, encrypted.
for number, (around, along) in enumerate([(64, 40), (40, 64), (56, 32)]):
    vertices, faces = vase(around, along)
    vertices[:, number] *= 1.0 + 0.5 * number
    model = write_obj(folder / f"model-{number}.obj", vertices, faces)
    sombrero.embed(model, owner="A. Shop", recipient=f"buyer {number}", catalogue=catalogue)

suspect = folder / "suspect.stl"
sombrero.attack(folder / "model-1-marked.obj", "transform noise:amplitude=0.001", suspect)

search = sombrero.search(suspect, catalogue)
best = search.candidates[0]
print(f"{best.original}, {best.recipient}: log10 p = {best.log10_p:.1f}")
assert search and (best.original, best.recipient) == ("model-1.obj", "buyer 1")
