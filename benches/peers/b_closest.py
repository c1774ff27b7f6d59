"""Stage b: closest points on a mesh for one query per vertex.
Accuracy: `rms_distance` from the queries to the points found, and `max_err`, the largest difference of a query's
distance from libigl's in double precision over the bbox diagonal."""
import sys
import numpy as np
from bench import LARGE, diag, load, measure, points


# Each gives (build or None, run on what was built, the points out of what run gave).
def same(x):
    return x


def igl_pmsd(v, f, q):
    import igl
    return None, lambda _: igl.point_mesh_squared_distance(q, v, f)[2], same


def igl_aabb(v, f, q):
    import igl
    def build():
        t = igl.AABB()
        t.init(v, f)
        return t
    return build, lambda t: t.squared_distance(v, f, q)[2], same


def open3d(v, f, q):
    import open3d as o3d
    v32, f32, q32 = v.astype(np.float32), f.astype(np.uint32), q.astype(np.float32)
    def build():
        s = o3d.t.geometry.RaycastingScene()
        s.add_triangles(o3d.core.Tensor(v32), o3d.core.Tensor(f32))
        s.compute_closest_points(o3d.core.Tensor(q32[:1]))  # the tree is built on first use
        return s
    return build, lambda s: s.compute_closest_points(o3d.core.Tensor(q32))["points"].numpy(), same


def pcu(v, f, q):
    import point_cloud_utils as p
    def run(_):
        _, face, weights = p.closest_points_on_mesh(q, v, f)
        return p.interpolate_barycentric_coords(f, face, weights, v)
    return None, run, same


def fcpw(v, f, q):
    import fcpw as fc
    v32, f32, q32 = v.astype(np.float32), f.astype(np.int32), q.astype(np.float32)
    def build():
        s = fc.scene_3D()
        s.set_object_count(1)
        s.set_object_vertices(v32, 0)
        s.set_object_triangles(f32, 0)
        s.build(fc.aggregate_type.bvh_surface_area, True, True)
        return s
    def run(s):
        found = fc.interaction_3D_list()
        s.find_closest_points(q32, np.full(len(q32), np.inf, np.float32), found)
        return found
    return build, run, lambda found: np.array([i.p for i in found])


def trimesh_proximity(v, f, q):
    import trimesh
    def build():
        m = trimesh.Trimesh(v, f, process=False)
        m.triangles_tree  # built on first use
        return m
    return build, lambda m: trimesh.proximity.closest_point(m, q)[0], same


def vtk_locator(v, f, q):
    import pyvista as pv
    m = pv.PolyData.from_regular_faces(v, f)
    return None, lambda _: m.find_closest_cell(q, return_closest_point=True)[1], same


def kdtree(v, f, q):
    from scipy.spatial import cKDTree
    return lambda: cKDTree(v), lambda t: t.query(q)[1], lambda nearest: v[nearest]


# With "build", "query" for those that can be timed apart.
PEERS = [("libigl point_mesh_squared_distance", "libigl", igl_pmsd, False),
         ("libigl AABB", "libigl", igl_aabb, True),
         ("open3d embree (float32)", "open3d", open3d, True),
         ("point-cloud-utils embree", "point_cloud_utils", pcu, False),
         ("fcpw (float32)", "fcpw", fcpw, True),
         ("trimesh proximity", "trimesh", trimesh_proximity, True),
         ("vtk cell locator", "vtk", vtk_locator, False),
         ("scipy cKDTree, vertices only (floor)", "scipy", kdtree, True)]


def reference(v, f, q):
    try:
        import igl
        return np.sqrt(igl.point_mesh_squared_distance(q, v, f)[0])
    except ImportError:
        return None  # then only the RMS distances can be compared


if __name__ == "__main__":
    for model in sys.argv[1:]:
        v, f = load(model)
        q = points(f"{model}.q.f64")
        ref = reference(v, f, q)
        for peer, package, make, apart in PEERS:
            if len(v) > LARGE and package == "trimesh":
                continue  # minutes
            def tree(t):
                build = make(v, f, q)[0]
                for _ in t:
                    with t:
                        build()
            def query(t):
                build, run, closest = make(v, f, q)
                built = build() if build else None
                for _ in t:
                    with t:
                        out = run(built)
                d = np.linalg.norm(closest(out) - q, axis=1)
                acc = dict(rms_distance=float(np.sqrt((d ** 2).mean())), queries=len(q))
                if ref is not None:
                    acc["max_err"] = float(np.abs(d - ref).max() / diag(v))
                return acc
            if apart:
                measure("b build", model, peer, package, tree)
            measure("b query" if apart else "b build+query", model, peer, package, query)
