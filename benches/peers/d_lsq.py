"""Stage d: least squares B w = r, with B the watermark matrix. Accuracy: relative error of w."""
import sys
import numpy as np
from bench import array, matrix, measure


def normal_equations():
    import scipy.linalg as la
    return lambda B, r: la.cho_solve(la.cho_factor((B.T @ B).toarray()), B.T @ r)


def lsqr():
    from scipy.sparse.linalg import lsqr
    return lambda B, r: lsqr(B, r, atol=1e-12, btol=1e-12, iter_lim=1000)[0]


def lsmr():
    from scipy.sparse.linalg import lsmr
    return lambda B, r: lsmr(B, r, atol=1e-12, btol=1e-12, maxiter=1000)[0]


def spqr():
    import sparseqr
    return lambda B, r: np.asarray(sparseqr.solve(B, r, tolerance=0)).ravel()


def dense():
    return lambda B, r: np.linalg.lstsq(B.toarray(), r, rcond=None)[0]


PEERS = [("scipy normal equations + Cholesky", "scipy", normal_equations),
         ("scipy lsqr", "scipy", lsqr),
         ("scipy lsmr", "scipy", lsmr),
         ("SuiteSparse SPQR (sparseqr)", "sparseqr", spqr),
         ("numpy lstsq, dense SVD", "numpy", dense)]

if __name__ == "__main__":
    for model in sys.argv[1:]:
        for peer, package, make in PEERS:
            def body(t):
                solve, B = make(), matrix(model)
                r, w = array(f"{model}.lsq.r"), array(f"{model}.lsq.w")
                for _ in t:
                    with t:
                        x = solve(B, r)
                return dict(rel_err=float(np.linalg.norm(x - w) / np.linalg.norm(w)), nnz=B.nnz)
            measure("d least squares", model, peer, package, body)
