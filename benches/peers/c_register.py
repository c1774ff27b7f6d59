"""Stage c: registration with scale of a suspect that was attacked and moved by a similarity.
Accuracy: RMS over the original's vertices of |T_found(T_true(v)) - v| over the bbox diagonal, median and worst of the
trials. `local` is given the case's rough pose; `global` starts blind."""
import os, sys
import numpy as np
from bench import CASES, LARGE, array, diag, load, measure

TRIALS = int(os.environ.get("TRIALS", "5"))
KINDS = ("clean", "simplify", "noise", "crop")
REFINE = "p2p+scale, p2plane"  # the chain after a global start
SLOW = ("pycpd rigid+scale, 1000 points", "trimesh mesh_other+scale", "open3d ICP p2plane (rigid)")


def similarity(s, R, t):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = s * R, t
    return T


def apply(T, p):
    return p @ T[:3, :3].T + T[:3, 3]


# Each method imports its library and gives (suspect P, F; original V, G; rough pose T0) -> original from suspect.
def cloud(p, f):
    import open3d as o3d
    m = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(p), o3d.utility.Vector3iVector(f.astype(np.int32)))
    m.compute_vertex_normals()
    c = o3d.geometry.PointCloud(m.vertices)
    c.normals = m.vertex_normals
    return c


def o3d_icp(kind):
    def make():
        import open3d as o3d
        R = o3d.pipelines.registration
        chain = {"p2p+scale": R.TransformationEstimationPointToPoint(True),
                 "p2plane": R.TransformationEstimationPointToPlane()}
        criteria = R.ICPConvergenceCriteria(1e-12, 1e-12, 200)
        def run(P, F, V, G, T0):
            suspect, original, T = cloud(P, F), cloud(V, G), T0
            for step in kind.split(", "):
                T = R.registration_icp(suspect, original, 0.05 * diag(V), T, chain[step], criteria).transformation
            return T
        return run
    return make


def gicp():
    import small_gicp
    def run(P, F, V, G, T0):
        s, d = np.cbrt(np.linalg.det(T0[:3, :3])), diag(V)  # a rigid method: the scale stays as it starts
        T1 = similarity(1, T0[:3, :3] / s, T0[:3, 3] / d)
        r = small_gicp.align(V / d, P * s / d, init_T_target_source=T1, registration_type="GICP",
                             downsampling_resolution=0.005, max_correspondence_distance=0.05, num_threads=os.cpu_count())
        return similarity(s, r.T_target_source[:3, :3], r.T_target_source[:3, 3] * d)
    return run


def trimesh_icp():
    import trimesh
    from trimesh import registration
    def run(P, F, V, G, T0):
        pick = np.random.default_rng(0).choice(len(P), 2000, False)
        m = trimesh.Trimesh(V, G, process=False)
        return registration.icp(P[pick], m, initial=T0, threshold=1e-12, max_iterations=30, scale=True, reflection=False)[0]
    return run


def cpd():
    import pycpd
    def run(P, F, V, G, T0):
        rng = np.random.default_rng(0)
        a, b = V[rng.choice(len(V), 1000, False)], apply(T0, P[rng.choice(len(P), 1000, False)])
        c, d = V.mean(0), diag(V)
        reg = pycpd.RigidRegistration(X=(a - c) / d, Y=(b - c) / d, max_iterations=100)
        reg.register()
        s, R, t = reg.get_registration_parameters()    # Y s R + t
        A = similarity(s, np.asarray(R).T, np.asarray(t) * d + c - s * np.asarray(R).T @ c)
        return A @ T0
    return run


def normalise(P, V):
    """P's mean and RMS radius brought to V's: the scale that a blind user would guess."""
    s = np.sqrt(((V - V.mean(0)) ** 2).sum(1).mean() / ((P - P.mean(0)) ** 2).sum(1).mean())
    return similarity(s, np.eye(3), V.mean(0) - s * P.mean(0))


def feature(kind):
    def make():
        import open3d as o3d
        R = o3d.pipelines.registration
        refine = o3d_icp(REFINE)()
        def run(P, F, V, G, T0):
            N, vox = normalise(P, V), 0.02 * diag(V)
            def prepare(p, f):
                c = cloud(p, f).voxel_down_sample(vox)
                c.normalize_normals()
                return c, R.compute_fpfh_feature(c, o3d.geometry.KDTreeSearchParamHybrid(5 * vox, 100))
            (a, fa), (b, fb) = prepare(apply(N, P), F), prepare(V, G)
            if kind == "RANSAC":
                o3d.utility.random.seed(1)
                r = R.registration_ransac_based_on_feature_matching(
                    a, b, fa, fb, True, 1.5 * vox, R.TransformationEstimationPointToPoint(True), 3,
                    [R.CorrespondenceCheckerBasedOnEdgeLength(0.8), R.CorrespondenceCheckerBasedOnDistance(1.5 * vox)],
                    R.RANSACConvergenceCriteria(200000, 0.999))
            else:
                option = R.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * vox)
                r = R.registration_fgr_based_on_feature_matching(a, b, fa, fb, option)
            return refine(P, F, V, G, r.transformation @ N)
        return run
    return make


def kiss():
    import kiss_matcher
    refine = o3d_icp(REFINE)()
    def run(P, F, V, G, T0):
        c, d, N = V.mean(0), diag(V), normalise(P, V)
        matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.02))
        r = matcher.estimate((apply(N, P) - c) / d, (V - c) / d)
        R, t = np.asarray(r.rotation), np.asarray(r.translation).ravel()
        return refine(P, F, V, G, similarity(1, R, t * d + c - R @ c) @ N)
    return run


def mesh_other():
    import trimesh
    from trimesh import registration
    def run(P, F, V, G, T0):
        np.random.seed(0)
        suspect, original = (trimesh.Trimesh(*m, process=False) for m in ((P, F), (V, G)))
        return registration.mesh_other(suspect, original, samples=500, scale=True)[0]
    return run


LOCAL = [("open3d ICP p2p+scale", "open3d", o3d_icp("p2p+scale")),
         ("open3d ICP p2plane (rigid)", "open3d", o3d_icp("p2plane")),
         ("open3d ICP p2p+scale, p2plane", "open3d", o3d_icp("p2p+scale, p2plane")),
         ("small_gicp GICP (rigid)", "small_gicp", gicp),
         ("trimesh icp+scale, 2000 points", "trimesh", trimesh_icp),
         ("pycpd rigid+scale, 1000 points", "pycpd", cpd)]
GLOBAL = [("open3d FPFH+RANSAC, then ICPs", "open3d", feature("RANSAC")),
          ("open3d FPFH+FGR, then ICPs", "open3d", feature("FGR")),
          ("KISS-Matcher, then open3d ICPs", "kiss_matcher", kiss),
          ("trimesh mesh_other+scale", "trimesh", mesh_other)]


def trials(model, kind):
    """Suspect, true pose (suspect from original) and rough pose (original from suspect), as many as there are."""
    names = [f"{model}.{kind}.{t}" for t in range(TRIALS)]
    return [(*load(n), *(array(f"{n}.{k}.f64").reshape(4, 4) for k in ("true", "start")))
            for n in names if os.path.exists(f"{CASES}/{n}.v.f64")]


if __name__ == "__main__":
    for model in sys.argv[1:]:
        v, f = load(model)
        large = len(v) > LARGE
        for start, peers in [("local", LOCAL)] + [("global", GLOBAL)] * (not large):
            for kind in KINDS:
                cases = trials(model, kind)
                for peer, package, make in peers if cases else ():
                    if peer in SLOW and (large or kind in ("clean", "noise")):
                        continue  # minutes, and the other kinds tell as much
                    def body(t):
                        method, errors = make(), {}
                        for i in t:
                            P, F, true, rough = cases[i]
                            with t:
                                T = method(P, F, v, f, rough)
                            off = apply(T @ true, v) - v
                            errors[i] = float(np.sqrt((off ** 2).sum(1).mean()) / diag(v))
                        return dict(rms=float(np.median(list(errors.values()))), worst=max(errors.values()))
                    measure(f"c {start}, {kind}", model, peer, package, body, repeats=len(cases))
