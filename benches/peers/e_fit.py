"""Stage e: bring the original's connectivity onto a suspect (marked, simplified to a half, in the original's pose).
Accuracy: RMS distance from the marked original's vertices over the bbox diagonal, and the correlation `rho` of the
watermark read from the fit with the true one."""
import sys
import numpy as np
from bench import LARGE, array, diag, load, matrix, measure, points
from d_lsq import normal_equations

HANDLES = 10  # every tenth vertex is tied to its closest point in the ARAP peers


# Each imports its library and gives (original v, f; suspect P, G) -> the original's vertices on the suspect.
def project():
    import igl
    return lambda v, f, P, G: igl.point_mesh_squared_distance(v, P, G)[2]


def project_embree():
    import open3d as o3d
    def run(v, f, P, G):
        s = o3d.t.geometry.RaycastingScene()
        s.add_triangles(o3d.core.Tensor(P.astype(np.float32)), o3d.core.Tensor(G.astype(np.uint32)))
        return s.compute_closest_points(o3d.core.Tensor(v.astype(np.float32)))["points"].numpy().astype(float)
    return run


def igl_arap():
    import igl
    closest = project()
    def run(v, f, P, G):
        b = np.arange(0, len(v), HANDLES)
        targets = closest(v[b], f, P, G)
        data = igl.ARAPData()
        data.max_iter = 10
        igl.arap_precomputation(v, f, 3, b, data)
        return igl.arap_solve(targets, data, v.copy())
    return run


def o3d_arap():
    import open3d as o3d
    closest = project()
    def run(v, f, P, G):
        b = np.arange(0, len(v), HANDLES)
        targets = closest(v[b], f, P, G)
        m = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(v), o3d.utility.Vector3iVector(f.astype(np.int32)))
        r = m.deform_as_rigid_as_possible(o3d.utility.IntVector(b.astype(np.int32)), o3d.utility.Vector3dVector(targets),
                                          max_iter=10)
        return np.asarray(r.vertices)
    return run


def nricp(function, steps):
    def make():
        import trimesh
        from trimesh import registration
        fit = getattr(registration, function)
        def run(v, f, P, G):
            original, suspect = (trimesh.Trimesh(*m, process=False) for m in ((v, f), (P, G)))
            return fit(original, suspect, steps=steps, distance_threshold=0.05)
        return run
    return make


PEERS = [("closest point, libigl (floor)", "libigl", project),
         ("closest point, open3d embree (floor)", "open3d", project_embree),
         ("libigl ARAP, 10 iterations", "libigl", igl_arap),
         ("open3d ARAP, 10 iterations", "open3d", o3d_arap),
         # smoothness, landmarks, normals, iterations
         ("trimesh nricp_amberg, 2 x 3 iterations", "trimesh", nricp("nricp_amberg", [[0.02, 0, 0.5, 3], [0.01, 0, 0.0, 3]])),
         # the first and the last of its default steps
         ("trimesh nricp_sumner, 2 steps", "trimesh", nricp("nricp_sumner", [[1, 0.001, 1, 0, 0], [100, 0.001, 1, 0, 0]]))]

if __name__ == "__main__":
    for model in sys.argv[1:]:
        v, f = load(model)
        P, G = load(f"{model}.fit")
        marked, w = points(f"{model}.fit.marked.f64"), array(f"{model}.fit.w")
        for peer, package, make in PEERS:
            if len(v) > LARGE and "closest" not in peer:
                continue  # minutes to hours
            def body(t):
                fit = make()
                for _ in t:
                    with t:
                        x = fit(v, f, P, G)
                read = normal_equations()(matrix(model), (x - v).ravel())
                return dict(rms=float(np.sqrt(((x - marked) ** 2).sum(1).mean()) / diag(v)),
                            rho=float(np.corrcoef(read, w)[0, 1]))
            measure("e fit", model, peer, package, body)
