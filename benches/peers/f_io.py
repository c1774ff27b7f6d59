"""Stage f: load and save OBJ (text) and PLY (binary). Accuracy: MB/s of the file, by the CPU time of the best run."""
import os, sys, tempfile
from bench import CASES, TMP, measure


# Each imports its library and gives (load path, save mesh to path).
def trimesh():
    import trimesh
    return lambda p: trimesh.load(p, process=False), lambda m, p: m.export(p)


def open3d():
    import open3d as o3d
    return o3d.io.read_triangle_mesh, lambda m, p: o3d.io.write_triangle_mesh(p, m)


def meshio():
    import meshio
    return meshio.read, lambda m, p: meshio.write(p, m)


def igl():
    import igl
    return igl.read_triangle_mesh, lambda m, p: igl.write_triangle_mesh(p, *m[:2])


def pcu():
    import point_cloud_utils as u
    return u.load_mesh_vf, lambda m, p: u.save_mesh_vf(p, *m)


def pymeshlab():
    import pymeshlab as pm
    def load(p):
        ms = pm.MeshSet(verbose=False)
        ms.load_new_mesh(p)
        return ms
    return load, lambda m, p: m.save_current_mesh(p)


PEERS = [("trimesh", "trimesh", trimesh), ("open3d", "open3d", open3d), ("meshio", "meshio", meshio),
         ("libigl", "libigl", igl), ("point-cloud-utils", "point_cloud_utils", pcu), ("pymeshlab", "pymeshlab", pymeshlab)]

if __name__ == "__main__":
    for model in sys.argv[1:]:
        for ext in ("obj", "ply"):
            path = f"{CASES}/{model}.{ext}"
            def rate(file, t):
                return dict(mb_s=os.path.getsize(file) / 1e6 / max(min(t.cpu), 1e-9))
            for peer, package, make in PEERS:
                def load(t):
                    read = make()[0]
                    for _ in t:
                        with t:
                            read(path)
                    return rate(path, t)
                def save(t):
                    read, write = make()
                    mesh = read(path)
                    with tempfile.TemporaryDirectory(dir=TMP) as folder:
                        for _ in t:
                            with t:
                                write(mesh, f"{folder}/saved.{ext}")
                        return rate(f"{folder}/saved.{ext}", t)
                measure(f"f load {ext}", model, peer, package, load)
                measure(f"f save {ext}", model, peer, package, save)
