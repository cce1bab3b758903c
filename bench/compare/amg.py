"""Solves the system of bench/benches/diffusion.rs with PyAMG: seconds of set-up and of the solve to 1e-8.

    pip install numpy scipy pyamg
    python bench/compare/amg.py 1025 2049
"""

import sys
import time

import numpy as np
import pyamg
import scipy.sparse as sparse


def lines(n):
    """Values of thirty lines of one node's width, NaN elsewhere."""
    given = np.full((n, n), np.nan)

    def weyl(k, step):
        return (k * step) % 1.0 * (n - 1)

    t = np.arange(2 * n + 1) / (2 * n)
    for k in range(1, 31):
        a = weyl(k, 0.754877666), weyl(k, 0.569840291)
        b = weyl(k, 0.819172513), weyl(k, 0.671043606)
        i, j = (np.floor(a[c] + t * (b[c] - a[c]) + 0.5).astype(int) for c in (0, 1))
        given[j, i] = 10.0 * k
    return given.ravel()


def system(n):
    """The Laplacian of the nodes that are not given, and its right-hand side."""
    step = sparse.diags([-np.ones(n - 1), np.r_[1.0, np.full(n - 2, 2.0), 1.0], -np.ones(n - 1)], [-1, 0, 1])
    whole = (sparse.kron(sparse.eye(n), step) + sparse.kron(step, sparse.eye(n))).tocsr()
    given = lines(n)
    free, fixed = np.flatnonzero(np.isnan(given)), np.flatnonzero(~np.isnan(given))
    rows = whole[free]
    return rows[:, free].tocsr(), -rows[:, fixed] @ given[fixed]


for n in map(int, sys.argv[1:] or ["1025"]):
    matrix, right = system(n)
    for name, setup in (("Ruge-Stuben", pyamg.ruge_stuben_solver), ("smoothed aggregation", pyamg.smoothed_aggregation_solver)):
        start = time.perf_counter()
        hierarchy = setup(matrix)
        ready = time.perf_counter()
        residuals = []
        hierarchy.solve(right, tol=1e-8, accel="cg", residuals=residuals)
        done = time.perf_counter()
        print(f"{n}: PyAMG {pyamg.__version__} {name}: {ready - start:.2f} + {done - ready:.2f} s, {len(residuals) - 1} iterations")
