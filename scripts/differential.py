#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares answers of the library with those of SciPy, scikit-learn, NumPy and Open3D, on seeded input of many kinds.

usage: scripts/differential.py [SECONDS [SEED]]     60 seconds and seed 0 if left out

Needs python3-scipy and python3-sklearn, asks Open3D (python3-open3d) where it is installed, and builds what answers (tests/differential/answers.cpp). Prints each case that
differs, with the seed that makes it, and returns how many did.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

try:
    import open3d
except ImportError:
    open3d = None

ROOT = pathlib.Path(__file__).resolve().parent.parent
KINDS = ["uniform", "clustered", "lattice", "line", "plane", "doubled", "far", "tiny", "huge", "few"]


def some_points(kind, random):
    d = int(random.integers(1, 6))
    n = 1 + int(random.integers(0, 12)) if kind == "few" else int(random.integers(50, 1500))
    p = random.uniform(-1, 1, (n, d))
    if kind == "clustered":
        p = random.uniform(-1, 1, (8, d))[random.integers(0, 8, n)] + random.normal(0, 0.03, (n, d))
    elif kind == "lattice":
        p = random.integers(-4, 5, (n, d)) * 0.25
    elif kind == "line":
        p = np.outer(random.uniform(-1, 1, n), random.normal(0, 1, d))
    elif kind == "plane":
        p[:, 0] = 0.5
    elif kind == "doubled":
        p = p[random.integers(0, n, n)]
    elif kind == "far":
        p = p + 1000
    elif kind == "tiny":
        p = p * 2.0**-30
    elif kind == "huge":
        p = p * 2.0**30
    return p


class Asked:
    def __init__(self, program, folder, scalar, points):
        self.program, self.folder, self.scalar = program, folder, scalar
        self.points = points.astype(np.float32).astype(np.float64) if scalar == "float" else points
        self.eps = np.finfo(np.float32 if scalar == "float" else np.float64).eps
        self.size = max(float(np.abs(self.points).max()), 1e-300)
        np.save(folder / "points.npy", self.points)

    def ask(self, question, *numbers):
        answer = self.folder / "answer.npy"
        subprocess.run([self.program, self.scalar, question, self.folder / "points.npy", answer,
                        *(repr(float(n)) for n in numbers)], check=True)
        return np.load(answer)


def same_partition(a, b):
    pairs = set(zip(a.tolist(), b.tolist()))
    return len(pairs) == len({x for x, _ in pairs}) == len({y for _, y in pairs})


def neighbors(asked, random):
    from scipy.spatial import cKDTree
    p, n = asked.points, len(asked.points)
    k = int(random.integers(1, min(n, 20) + 1))
    truth = cKDTree(p).query(p, k)[0].reshape(n, k)
    found = asked.ask("knn", k)
    indices, distances = found[:, :k].astype(int), found[:, k:]
    measured = np.linalg.norm(p[:, None] - p[indices], axis=2)
    slack = 20 * asked.eps * asked.size
    yield "knn distances", np.abs(distances - truth).max() <= slack
    yield "knn indices", np.abs(measured - truth).max() <= slack
    yield "knn ties", all(sorted(set(row)) == sorted(row) for row in indices.tolist())


def within(asked, random):
    p = asked.points
    reach = asked.size * float(random.uniform(0.05, 0.6))
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    edge = 8 * asked.eps * asked.size
    least, most = (apart < reach - edge).sum(1), (apart <= reach + edge).sum(1)
    found = asked.ask("radius", reach)[:, 0]
    yield "radius", ((least <= found) & (found <= most)).all()


def moments(asked, random):
    p = asked.points
    found = asked.ask("moments")
    yield "mean", np.abs(found[0] - p.mean(0)).max() <= 64 * asked.eps * asked.size
    truth = np.cov(p.T).reshape(p.shape[1], -1) if len(p) > 1 else np.zeros((p.shape[1],) * 2)
    spread = max(float(np.abs(truth).max()), 1e-300)
    yield "covariance", np.abs(found[1:] - truth).max() <= 1e-9 * spread + 1e-13 * asked.size**2
    values = np.linalg.eigvalsh(truth)[::-1]
    shares = asked.ask("principal")
    yield "variances", np.abs(shares[0] - values).max() <= 1e-9 * spread + 1e-13 * asked.size**2
    yield "axes", np.abs(shares[1:] @ shares[1:].T - np.eye(p.shape[1])).max() <= 100 * asked.eps


def normals(asked, random):
    p, n = asked.points, len(asked.points)
    if n < 4:
        return
    k = int(random.integers(3, min(n, 20) + 1))
    indices = asked.ask("knn", k)[:, :k].astype(int)
    found = asked.ask("normals", k)
    near = p[indices] - p[indices].mean(1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))
    clear = values[:, -1] > (1e4 * asked.eps * asked.size) ** 2
    if p.shape[1] > 1:
        clear &= values[:, 1] - values[:, 0] > 1e-4 * values[:, -1]
    share = values[:, 0] / np.maximum(values.sum(1), 1e-300)
    along = np.abs(np.einsum("ni,ni->n", found[:, :-1], vectors[:, :, 0]))
    yield "normals", (along[clear] > 1 - 1e-6).all()
    yield "curvature", (np.abs(found[clear, -1] - share[clear]) < 1e-5).all()
    if open3d and p.shape[1] == 3:
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(p))
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(k))
        # Of points at the same distance, each library takes its own.
        distances = np.sort(np.linalg.norm(p[:, None] - p[None], axis=2), axis=1)
        no_tie = distances[:, k] - distances[:, k - 1] > 1e-6 * asked.size if k < n else clear
        sure = clear & no_tie
        theirs = np.abs(np.einsum("ni,ni->n", found[:, :-1], np.asarray(cloud.normals)))
        yield "normals of Open3D", (theirs[sure] > 1 - 1e-5).all()


def registration(asked, random):
    p = asked.points
    if not open3d or p.shape[1] != 3 or asked.scalar != "double" or len(p) < 20:
        return
    iterations = int(random.integers(1, 20))
    reach, angle = asked.size * float(random.uniform(0.1, 0.5)), float(random.uniform(0.02, 0.3))
    c, s = np.cos(angle), np.sin(angle)
    # About the middle: clouds that do not overlap pair all points with the same few.
    turned = (p - p.mean(0)) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + p.mean(0)
    clouds = [open3d.geometry.PointCloud(open3d.utility.Vector3dVector(m)) for m in (turned, p)]
    methods = open3d.pipelines.registration
    truth = methods.registration_icp(*clouds, reach, np.eye(4), methods.TransformationEstimationPointToPoint(),
                                     methods.ICPConvergenceCriteria(0, 0, iterations))
    found = asked.ask("icp", iterations, reach, angle)
    if np.linalg.matrix_rank(p - p.mean(0), 1e-6 * asked.size) < 2:
        return  # Turning about a line is left open.
    yield "ICP of Open3D", np.abs(found - truth.transformation)[:3].max() <= 1e-6 * max(asked.size, 1)


def outliers(asked, random):
    from scipy.spatial import cKDTree
    p, k = asked.points, int(random.integers(1, 10))
    if len(p) <= k + 1:
        return
    mean = cKDTree(p).query(p, k + 1)[0][:, 1:].mean(1)
    limit, edge = mean.mean() + 1.5 * mean.std(ddof=1), 1e3 * asked.eps * asked.size
    kept = set(asked.ask("outliers", k, 1.5)[:, 0].astype(int).tolist())
    yield "outliers", all(i in kept for i in np.flatnonzero(mean < limit - edge)) and all(
        i not in kept for i in np.flatnonzero(mean > limit + edge))


def density(asked, random):
    from sklearn.cluster import DBSCAN
    p = asked.points
    reach, least = asked.size * float(random.uniform(0.03, 0.3)), int(random.integers(1, 8))
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    if (np.abs(apart - reach) < 8 * asked.eps * asked.size).any():
        return  # Which side of the radius is a matter of rounding.
    truth = DBSCAN(eps=reach, min_samples=least, algorithm="brute").fit(p)
    found = asked.ask("dbscan", reach, least)
    core = np.zeros(len(p), bool)
    core[truth.core_sample_indices_] = True
    yield "dbscan cores", (found[:, 1].astype(bool) == core).all()
    yield "dbscan noise", ((found[:, 0] < 0) == (truth.labels_ < 0)).all()
    yield "dbscan partition", same_partition(found[core, 0], truth.labels_[core])


def components(asked, random):
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components
    p, reach = asked.points, asked.size * float(random.uniform(0.02, 0.2))
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    if (np.abs(apart - reach) < 8 * asked.eps * asked.size).any():
        return
    truth = connected_components(csr_matrix(apart <= reach))[1]
    yield "components", same_partition(asked.ask("components", reach)[:, 0], truth)


def voxels(asked, random):
    p, edge = asked.points, asked.size * float(random.uniform(0.1, 0.7))
    cells, member = np.unique(np.floor(p / edge), axis=0, return_inverse=True)
    truth = np.stack([p[member.ravel() == c].mean(0) for c in range(len(cells))])
    found = asked.ask("voxels", edge)
    yield "voxels", found.shape == truth.shape and np.abs(found - truth).max() <= 64 * asked.eps * asked.size


QUESTIONS = [neighbors, within, moments, normals, registration, outliers, density, components, voxels]


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    subprocess.run([ROOT / "scripts/build.sh", "release", "differential_answers"], check=True)
    program = ROOT / "build/release/tests/differential_answers"
    compared, differ, end = {}, 0, time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < end:
            random = np.random.default_rng(seed)
            kind, scalar = KINDS[seed % len(KINDS)], ("float", "double")[seed // len(KINDS) % 2]
            asked = Asked(program, pathlib.Path(folder), scalar, some_points(kind, random))
            for question in QUESTIONS:
                for what, is_same in question(asked, random):
                    compared[what] = compared.get(what, 0) + 1
                    if not is_same:
                        differ += 1
                        print(f"{what} differs: seed {seed}, {kind}, {scalar}, {asked.points.shape}")
            seed += 1
    print(f"{sum(compared.values())} comparisons, {differ} differ: " +
          ", ".join(f"{n} {what}" for what, n in sorted(compared.items())))
    sys.exit(min(differ, 100))


if __name__ == "__main__":
    main()
