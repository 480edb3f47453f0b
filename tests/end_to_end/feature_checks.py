# SPDX-License-Identifier: MIT
"""How far the sharp edges and boundaries of two meshes lie apart, without any of Rattan's own code."""

import math
from collections import defaultdict


def _sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _normal(vertices, face):
    n = (0.0, 0.0, 0.0)
    for k in range(1, len(face) - 1):
        c = _cross(_sub(vertices[face[k]], vertices[face[0]]),
                   _sub(vertices[face[k + 1]], vertices[face[0]]))
        n = (n[0] + c[0], n[1] + c[1], n[2] + c[2])
    length = math.sqrt(_dot(n, n))
    return tuple(x / length for x in n) if length > 0.0 else n


def edges(faces):
    """{(low, high): faces beside it}."""
    found = defaultdict(list)
    for f, face in enumerate(faces):
        for a, b in zip(face, face[1:] + face[:1]):
            found[min(a, b), max(a, b)].append(f)
    return found


def feature_edges(vertices, faces, degrees):
    """Edges of one face, and edges across which the normal turns by `degrees` or more."""
    normals = [_normal(vertices, f) for f in faces]
    limit = math.cos(math.radians(degrees))
    boundary, sharp = [], []
    for edge, beside in edges(faces).items():
        if len(beside) == 1:
            boundary.append(edge)
        elif _dot(normals[beside[0]], normals[beside[1]]) <= limit:
            sharp.append(edge)
    return boundary, sharp


def long_components(vertices, chosen, least):
    """Those of the edges in connected components of a total length of at least `least`."""
    parent = {}

    def root(v):
        while parent.setdefault(v, v) != v:
            parent[v] = parent[parent[v]]
            v = parent[v]
        return v

    for a, b in chosen:
        parent[root(a)] = root(b)
    total = defaultdict(float)
    for a, b in chosen:
        total[root(a)] += math.dist(vertices[a], vertices[b])
    return [e for e in chosen if total[root(e[0])] >= least]


def diagonal(vertices):
    return math.dist([min(v[k] for v in vertices) for k in range(3)],
                     [max(v[k] for v in vertices) for k in range(3)])


class Segments:
    """Distances to a set of edges, by a grid."""

    def __init__(self, vertices, chosen, cell):
        self.cell = cell
        self.ends = [(vertices[a], vertices[b]) for a, b in chosen]
        self.grid = defaultdict(list)
        for i, (p, q) in enumerate(self.ends):
            low = [math.floor(min(p[k], q[k]) / cell) for k in range(3)]
            high = [math.floor(max(p[k], q[k]) / cell) for k in range(3)]
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    for z in range(low[2], high[2] + 1):
                        self.grid[x, y, z].append(i)

    def distance(self, p, most_cells=8):
        at = [math.floor(x / self.cell) for x in p]
        best = math.inf
        for reach in range(most_cells + 1):
            if best <= (reach - 1) * self.cell:
                break
            for x in range(-reach, reach + 1):
                for y in range(-reach, reach + 1):
                    step = 1 if max(abs(x), abs(y)) == reach else max(2 * reach, 1)
                    for z in range(-reach, reach + 1, step):
                        for i in self.grid.get((at[0] + x, at[1] + y, at[2] + z), ()):
                            best = min(best, self.to_segment(i, p))
        return best

    def to_segment(self, i, p):
        a, b = self.ends[i]
        d = _sub(b, a)
        length2 = _dot(d, d)
        t = max(0.0, min(1.0, _dot(_sub(p, a), d) / length2)) if length2 > 0.0 else 0.0
        return math.dist(p, (a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]))


def farthest(from_vertices, chosen, segments, samples=5):
    """The largest distance of points on the chosen edges from the segments."""
    worst = 0.0
    for a, b in chosen:
        p, q = from_vertices[a], from_vertices[b]
        for k in range(samples):
            t = (k + 0.5) / samples
            worst = max(worst, segments.distance(tuple(p[i] + t * (q[i] - p[i]) for i in range(3))))
    return worst
