"""Stage a: simplify to a base mesh of 200 faces. The caller scores the meshes left in $PEERS_TMP."""
import sys
import numpy as np
from bench import keep, load, measure

TARGET = 200


def fast_simplification(v, f):
    import fast_simplification as fs
    v32, f32 = v.astype(np.float32), f.astype(np.int32)
    return lambda: fs.simplify(v32, f32, target_count=TARGET)


def pyfqmr(v, f):
    import pyfqmr
    def run():
        s = pyfqmr.Simplify()
        s.setMesh(v, f)
        s.simplify_mesh(target_count=TARGET, preserve_border=False, verbose=False)
        return s.getMesh()[:2]
    return run


def pymeshlab(optimal):
    def make(v, f):
        import pymeshlab
        f32 = f.astype(np.int32)
        def run():
            ms = pymeshlab.MeshSet(verbose=False)
            ms.add_mesh(pymeshlab.Mesh(v, f32))
            ms.meshing_decimation_quadric_edge_collapse(targetfacenum=TARGET, optimalplacement=optimal)
            m = ms.current_mesh()
            return m.vertex_matrix(), m.face_matrix()
        return run
    return make


def open3d(v, f):
    import open3d as o3d
    m = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(v), o3d.utility.Vector3iVector(f.astype(np.int32)))
    def run():
        s = m.simplify_quadric_decimation(TARGET)
        return np.asarray(s.vertices), np.asarray(s.triangles)
    return run


def igl_decimate(v, f):
    import igl
    return lambda: igl.decimate(v, f, max_m=TARGET)[:2]


def igl_qslim(v, f):
    import igl
    return lambda: igl.qslim(v, f, max_m=TARGET)[:2]


def vtk(kind):
    def make(v, f):
        import pyvista as pv
        m = pv.PolyData.from_regular_faces(v, f)
        reduction = 1 - TARGET / len(f)
        def run():
            s = m.decimate(reduction) if kind == "quadric" else m.decimate_pro(reduction, preserve_topology=False)
            return s.points, s.regular_faces
        return run
    return make


PEERS = [("fast-simplification", "fast_simplification", fast_simplification),
         ("pyfqmr", "pyfqmr", pyfqmr),
         ("pymeshlab quadric", "pymeshlab", pymeshlab(True)),
         ("pymeshlab quadric half-edge", "pymeshlab", pymeshlab(False)),
         ("open3d quadric", "open3d", open3d),
         ("libigl decimate", "libigl", igl_decimate),
         ("libigl qslim", "libigl", igl_qslim),
         ("vtk quadric", "vtk", vtk("quadric")),
         ("vtk decimate_pro", "vtk", vtk("pro"))]

if __name__ == "__main__":
    for model in sys.argv[1:]:
        v, f = load(model)
        for peer, package, make in PEERS:
            def body(t):
                run = make(v, f)
                for _ in t:
                    with t:
                        out = run()
                return keep(model, peer, *out)
            measure("a simplify to 200 faces", model, peer, package, body)
