"""Files written by trimesh, marked by sombrero, read by trimesh: only positions may differ.

Usage: python3 tests/trimesh/roundtrip.py PATH/TO/sombrero

An independent writer makes the files and an independent reader looks at them, so that a mistake which our own
reader and writer share does not hide. Exit status 0 when all is well, 1 otherwise.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh


def bumpy(seed: int) -> trimesh.Trimesh:
    """A ball with relief."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    rng = np.random.default_rng(seed)
    points = ball.vertices.copy()
    radius = np.ones(len(points))
    for direction in rng.normal(size=(12, 3)):
        radius += 0.05 * np.sin(2.5 * points @ direction)
    return trimesh.Trimesh(points * radius[:, None], ball.faces, process=False)


def textured(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh with texture coordinates, a material, and a seam where vertices are doubled."""
    half = len(mesh.faces) // 2
    count = len(mesh.vertices)
    points = np.vstack([mesh.vertices, mesh.vertices])
    faces = np.vstack([mesh.faces[:half], mesh.faces[half:] + count])
    uv = np.column_stack([np.linspace(0, 1, 2 * count), np.linspace(1, 0, 2 * count)])
    material = trimesh.visual.material.PBRMaterial(name="clay", baseColorFactor=[200, 120, 80, 255])
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return trimesh.Trimesh(points, faces, visual=visual, process=False)


def coloured(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    colours = np.arange(4 * len(mesh.vertices)).reshape(-1, 4) % 256
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=colours.astype(np.uint8), process=False)


def with_normals(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_normals=mesh.vertex_normals, process=False)


def assembly(mesh: trimesh.Trimesh) -> trimesh.Scene:
    """One mesh placed twice, and another one, under transforms."""
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.7, [0.3, 1.0, 0.2], [1, 2, 3])
    scene.add_geometry(mesh, geom_name="ball", node_name="one", transform=turn)
    shift = turn.copy()
    shift[:3, 3] += [9, 0, 0]
    scene.graph.update(frame_to="two", matrix=shift, geometry="ball")
    scene.add_geometry(bumpy(2), geom_name="other", node_name="three", transform=trimesh.transformations.scale_matrix(0.5))
    return scene


def cases(folder: Path):
    """Name and path of each file, once written."""
    ball = bumpy(1)
    plain = {"obj": ball, "ply": ball, "off": ball, "stl": ball, "glb": ball, "gltf": ball, "3mf": ball}
    rich = {
        "obj": textured(ball),
        "ply": coloured(ball),
        "off": coloured(ball),
        "glb": textured(with_normals(ball)),
        "gltf": coloured(ball),
    }
    scenes = {"glb": assembly(ball), "gltf": assembly(ball), "3mf": assembly(ball)}
    for kind, files in [("plain", plain), ("rich", rich), ("scene", scenes)]:
        for extension, thing in files.items():
            path = folder / f"{kind}-{extension}" / f"model.{extension}"
            path.parent.mkdir()
            write(thing, path)
            yield f"{kind} {extension}", path
    for name, options in [("ASCII ply", {"file_type": "ply", "encoding": "ascii"}), ("ASCII stl", {"file_type": "stl_ascii"})]:
        path = folder / name / f"model.{options['file_type'][:3]}"
        path.parent.mkdir()
        data = ball.export(**options)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        yield name, path


def write(thing, path: Path) -> None:
    """trimesh writes what belongs beside an OBJ or a glTF into the same folder."""
    if path.suffix == ".gltf":
        files = trimesh.exchange.gltf.export_gltf(thing if isinstance(thing, trimesh.Scene) else trimesh.Scene(thing))
        for name, data in files.items():
            (path.parent / name).write_bytes(data)
    else:
        thing.export(path)


def run(binary: str, *args) -> dict:
    done = subprocess.run([binary, *map(str, args), "--json"], capture_output=True, text=True, check=False)
    if done.returncode == 2:
        raise AssertionError(f"sombrero {args[0]}: {done.stdout}{done.stderr}")
    return json.loads(done.stdout)


def meshes(path: Path) -> dict:
    """Geometries by name, as stored, and where the scene puts them."""
    scene = trimesh.load_scene(path, process=False, maintain_order=True)
    nodes = sorted((scene.graph[n][1], scene.graph[n][0].round(9).tolist()) for n in scene.graph.nodes_geometry)
    return {"geometry": dict(sorted(scene.geometry.items())), "nodes": nodes, "scene": scene}


def attributes(mesh: trimesh.Trimesh) -> dict:
    """What hangs on vertices and is not a position."""
    found = {}
    if mesh.visual.kind == "texture":
        found["uv"] = mesh.visual.uv
        found["material"] = mesh.visual.material.name
    elif mesh.visual.kind in ("vertex", "face"):
        found["colours"] = mesh.visual.vertex_colors if mesh.visual.kind == "vertex" else mesh.visual.face_colors
    if "vertex_normals" in mesh._cache and mesh.metadata.get("file_path", "").endswith("glb"):
        found["normals"] = mesh.vertex_normals
    return found


def same(a, b) -> bool:
    return a is b or (np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b)


def check(binary: str, name: str, path: Path) -> None:
    copy = path.parent / "out" / path.name
    copy.parent.mkdir()
    for beside in path.parent.glob("*"):
        if beside.suffix in (".mtl", ".png", ".jpg"):
            (copy.parent / beside.name).write_bytes(beside.read_bytes())
    key = path.parent / "model.key"
    secret = path.parent / "secret"
    secret.write_text("ab" * 32)
    told = run(binary, "embed", path, "-o", copy, "--key", key, "--secret-file", secret)
    before, after = meshes(path), meshes(copy)
    assert before["geometry"].keys() == after["geometry"].keys(), "geometries have other names"
    assert before["nodes"] == after["nodes"], "the scene has changed"
    for geometry, old in before["geometry"].items():
        new = after["geometry"][geometry]
        assert old.vertices.shape == new.vertices.shape, f"{geometry}: vertices came or went"
        assert np.array_equal(old.faces, new.faces), f"{geometry}: faces have changed"
        moved = np.linalg.norm(old.vertices - new.vertices, axis=1)
        size = old.extents.max()
        assert 0 < moved.max() < 0.03 * size, f"{geometry}: moved by {moved.max() / size}"
        for attribute, value in attributes(old).items():
            assert same(value, attributes(new)[attribute]), f"{geometry}: {attribute} have changed"
    about = run(binary, "info", path)
    faces = sum(len(before["geometry"][name].faces) for name, _ in before["nodes"])
    assert about["triangles"] == faces, f"info counts {about['triangles']} triangles, trimesh {faces}"
    bounds = before["scene"].bounds
    box = [about["bounding_box"]["min"], about["bounding_box"]["max"]]
    if len(before["nodes"]) == 1:
        assert np.allclose(bounds, box, atol=1e-5), f"bounding box {box}, trimesh {bounds.tolist()}"
    found = run(binary, "detect", copy, "--original", path, "--key", key)
    assert found["detected"] and found["log10_p"] < -100, f"log10 p = {found['log10_p']}"
    # The whole scene as trimesh sees it, as facets in another file.
    facets = path.parent / "found.stl"
    after["scene"].to_mesh().export(facets)
    found = run(binary, "detect", facets, "--original", path, "--key", key)
    assert found["detected"], f"as STL: log10 p = {found['log10_p']}"
    print(f"{name}: {told['vertices']} vertices, log10 p as STL {found['log10_p']:.0f}")


def main() -> int:
    binary = str(Path(sys.argv[1]).resolve())
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, path in cases(Path(folder)):
            try:
                check(binary, name, path)
            except AssertionError as error:
                failures += 1
                print(f"{name}: FAILED: {error}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
