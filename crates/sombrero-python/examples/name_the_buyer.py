"""A copy for each buyer, and the one whose copy turns up."""

import sombrero
from shapes import vase

original = vase()
buyers = ["order 1001", "order 1002", "order 1003"]

copies = {buyer: sombrero.embed(original, owner="A. Shop", recipient=buyer) for buyer in buyers}

leaked = sombrero.attack((copies["order 1002"].points, original[1]), "transform noise:amplitude=0.001 simplify:ratio=0.7")

trace = sombrero.trace((leaked.points, leaked.triangles), original, [copy.key for copy in copies.values()])
for one in trace.recipients:
    print(f"{one.recipient}: log10 p = {one.log10_p:.1f}{', named' if one.named else ''}")
assert [one.recipient for one in trace.recipients if one.named] == ["order 1002"]

# Many copies of one file are quicker made by one command:
# sombrero.command("embed", "vase.obj", "--recipients", "buyers.csv", "--out-dir", "copies")
