"""Mark arrays of numpy, as any library has them; vertices keep their order."""

import numpy as np

import sombrero
from shapes import vase

vertices, faces = vase()

marked = sombrero.embed((vertices, faces), owner="A. Museum", recipient="order 1001")
print(f"{marked.points.shape} {marked.points.dtype}, {marked.coefficients} coefficients, {marked.key}")

# With trimesh: mesh = trimesh.load("vase.obj"); mesh.vertices = sombrero.embed(mesh).points
# With Open3D: mesh.vertices = o3d.utility.Vector3dVector(sombrero.embed(mesh).points)
# With PyVista: mesh.points = sombrero.embed(mesh).points

# What is to be kept: the key, and the original, either these very arrays or the file that they stand for.
original = sombrero.to_ply((vertices, faces))
print(f"original: {len(original)} bytes of PLY")

# A suspect in another pose and in other units.
turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
noise = np.random.default_rng(1).normal(scale=0.001, size=vertices.shape)
suspect = 25.4 * (marked.points + noise) @ turn.T + [10.0, 0.0, 3.0]

detection = sombrero.detect((suspect, faces), (vertices, faces), marked.key)
print(f"found: {detection.detected}, log10 p = {detection.log10_p:.1f}")
print("suspect to original:\n", np.array(detection.registration.matrix).round(4))
assert detection
