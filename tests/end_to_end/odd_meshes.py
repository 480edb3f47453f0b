# SPDX-License-Identifier: MIT
"""Small scans with something odd about each of them, as (vertices, triangles)."""

import math
import random

NAN = float("nan")


def grid(nu, nv, place, wrap_u=False, wrap_v=False, twist=False):
    """Cells of nu x nv; place(u, v) with both from 0 to 1. With twist the wrap in u turns v over."""
    pu, pv = nu + (not wrap_u), nv + (not wrap_v)

    def index(u, v):
        if twist and u == nu:
            u, v = 0, (nv - v) % nv if wrap_v else nv - v
        return (u % pu) * pv + v % pv

    vertices = [place(u / nu, v / nv) for u in range(pu) for v in range(pv)]
    triangles = []
    for u in range(nu):
        for v in range(nv):
            a, b, c, d = index(u, v), index(u + 1, v), index(u + 1, v + 1), index(u, v + 1)
            triangles += [(a, b, c), (a, c, d)]
    return vertices, triangles


def joined(*meshes):
    vertices, triangles = [], []
    for v, t in meshes:
        n = len(vertices)
        vertices += v
        triangles += [tuple(c + n for c in corners) for corners in t]
    return vertices, triangles


def moved(mesh, by=(0, 0, 0), scale=1):
    s = scale if isinstance(scale, tuple) else (scale,) * 3
    return [tuple(x * f + b for x, f, b in zip(p, s, by)) for p in mesh[0]], mesh[1]


def tetrahedron(size=1.0):
    return ([(0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size)],
            [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def sphere(nu=24, nv=12):
    vertices = [(0, 0, 1), (0, 0, -1)]
    for i in range(1, nv):
        for j in range(nu):
            a, b = math.pi * i / nv, 2 * math.pi * j / nu
            vertices.append((math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)))
    at = lambda i, j: 2 + (i - 1) * nu + j % nu
    triangles = []
    for j in range(nu):
        triangles += [(0, at(1, j), at(1, j + 1)), (1, at(nv - 1, j + 1), at(nv - 1, j))]
        for i in range(1, nv - 1):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            triangles += [(a, b, c), (a, c, d)]
    return vertices, triangles


def box(n, size):
    """A closed box of n x n cells a side."""
    number, vertices, triangles = {}, [], []

    def vertex(p):
        if p not in number:
            number[p] = len(vertices)
            vertices.append(tuple(x / n * s for x, s in zip(p, size)))
        return number[p]

    for axis in range(3):
        for level in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = level, i + di, j + dj
                        corners.append(vertex(tuple(p)))
                    if level == 0:
                        corners.reverse()
                    a, b, c, d = corners
                    triangles += [(a, b, c), (a, c, d)]
    return vertices, triangles


def torus(nu=24, nv=12, r=0.4):
    return grid(nu, nv, lambda u, v: ((1 + r * math.cos(2 * math.pi * v)) * math.cos(2 * math.pi * u),
                                      (1 + r * math.cos(2 * math.pi * v)) * math.sin(2 * math.pi * u),
                                      r * math.sin(2 * math.pi * v)), True, True)


def moebius(nu=40, nv=4, width=0.8):
    def place(u, v):
        a, w = 2 * math.pi * u, width * (v - 0.5)
        r = 1 + w * math.cos(a / 2)
        return (r * math.cos(a), r * math.sin(a), w * math.sin(a / 2))
    return grid(nu, nv, place, wrap_u=True, twist=True)


def klein_bottle(nu=40, nv=16):
    def place(u, v):
        a, b = 2 * math.pi * u, 2 * math.pi * v
        w = math.cos(a / 2) * math.sin(b) - math.sin(a / 2) * math.sin(2 * b)
        r = 2 + w
        return (r * math.cos(a), r * math.sin(a),
                math.sin(a / 2) * math.sin(b) + math.cos(a / 2) * math.sin(2 * b))
    return grid(nu, nv, place, True, True, twist=True)


def sheet(n=12, place=lambda u, v: (u, v, 0)):
    return grid(n, n, place)


def needles(n=60):
    """Two rows of vertices close together and a far one: triangles a million times longer than wide."""
    return grid(n, 1, lambda u, v: (u * 1e-3, v * 1e3, 0))


def collapsed(n=8, rank=0):
    """All vertices at one point, or on one line."""
    return grid(n, n, lambda u, v: (u + 2 * v if rank else 1, 0, 0))


def annulus(n=3):
    return grid(n, 1, lambda u, v: ((1 + v) * math.cos(2 * math.pi * u),
                                    (1 + v) * math.sin(2 * math.pi * u), 0), wrap_u=True)


def pinched():
    """Two spheres that share one vertex."""
    a = sphere()
    b = moved(sphere(), (0, 0, 2))
    vertices, triangles = joined(a, b)
    n = len(a[0])
    return vertices, [tuple(0 if c == n + 1 else c for c in t) for t in triangles]


def tiny_components(count=10000):
    return joined(*(moved(tetrahedron(), (3 * (i % 22), 3 * (i // 22 % 22), 3 * (i // 484)))
                    for i in range(count)))


def with_nan():
    vertices, triangles = sphere()
    vertices[40] = (NAN, 0, 0)
    vertices[95] = (0, float("inf"), 0)
    return vertices, triangles


def book():
    return ([(0, 0, 0), (0, 0, 1)] + [(math.cos(k), math.sin(k), 0.5) for k in range(5)],
            [(0, 1, 2 + k) for k in range(5)])


def noise(count=300, seed=1):
    """Triangles between random vertices."""
    draw = random.Random(seed)
    vertices = [(draw.random(), draw.random(), draw.random()) for _ in range(count // 3)]
    return vertices, [tuple(draw.randrange(len(vertices)) for _ in range(3)) for _ in range(count)]


def turned(mesh, seed=2):
    draw = random.Random(seed)
    return mesh[0], [t if draw.random() < 0.5 else (t[0], t[2], t[1]) for t in mesh[1]]


def exploded(mesh):
    vertices = [mesh[0][c] for t in mesh[1] for c in t]
    return vertices, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(len(mesh[1]))]


def spiky(n=20):
    """A sphere with every ninth vertex far out."""
    vertices, triangles = sphere(n, n // 2)
    return [tuple(x * (30 if i % 9 == 0 else 1) for x in p) for i, p in enumerate(vertices)], triangles


def fan(n=500):
    """All triangles around one vertex."""
    ring = [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n), 0) for i in range(n)]
    return [(0, 0, 0)] + ring, [(0, 1 + i, 1 + (i + 1) % n) for i in range(n)]


def all_meshes():
    flat = sheet()
    return {
        "one_triangle": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
        "two_triangles": grid(1, 1, lambda u, v: (u, v, 0)),
        "two_apart": joined(*[([(x, 0, 0), (x + 1, 0, 0), (x, 1, 0)], [(0, 1, 2)]) for x in (0, 5)]),
        "flat_sheet": flat,
        "needles": needles(),
        "one_needle": ([(0, 0, 0), (1, 0, 0), (0.5, 1e-9, 0)], [(0, 1, 2)]),
        "all_at_one_point": collapsed(),
        "all_on_a_line": collapsed(rank=1),
        "one_without_area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]),
        "repeated_indices_only": ([(0, 0, 0), (1, 0, 0)], [(0, 1, 1), (0, 0, 1)]),
        "flat_box": box(6, (1, 1, 1e-6)),
        "thin_box": box(6, (1, 1e-4, 1e-4)),
        "long_box": box(6, (1e5, 1, 1)),
        "cube": box(1, (1, 1, 1)),
        "nested": joined(*(moved(sphere(), scale=s) for s in (1, 0.7, 0.1, 0.01))),
        "tiny_components": tiny_components(),
        "mixed_scales": joined(moved(sphere(40, 20), scale=1000),
                               *(moved(tetrahedron(1e-3), (i, 0, 0)) for i in range(200))),
        "nan": with_nan(),
        "huge": moved(torus(), scale=1e30),
        "minute": moved(torus(), scale=1e-30),
        "far_and_minute": joined(sphere(), moved(tetrahedron(), (1e30, 0, 0))),
        "beyond_float": moved(sphere(), scale=1e80),
        "pinched": pinched(),
        "moebius": moebius(),
        "narrow_moebius": moebius(9, 1),
        "klein_bottle": klein_bottle(),
        "coincident": joined(flat, flat),
        "coincident_opposed": joined(flat, (flat[0], [t[::-1] for t in flat[1]])),
        "strip": grid(50, 1, lambda u, v: (50 * u, v, math.sin(9 * u))),
        "closed_strip": annulus(40),
        "annulus": annulus(),
        "annulus_of_two": annulus(2),
        "tetrahedron": tetrahedron(),
        "pillow": (tetrahedron()[0][:3], [(0, 1, 2), (0, 2, 1)]),
        "book": book(),
        "noise": noise(),
        "noise_dense": noise(2000, 3),
        "turned": turned(torus()),
        "soup": exploded(torus()),
        "spiky": spiky(),
        "fan": fan(),
        "zero_area_patch": sheet(12, lambda u, v: (max(u, 0.5), v, 0)),
        "torus_of_few": grid(3, 3, lambda u, v: (u, v, math.sin(9 * u + 5 * v)), True, True),
    }


def write_ply(path, mesh, colours=None):
    import struct
    vertices, triangles = mesh
    tint = "".join(f"property uchar {c}\n" for c in ("red", "green", "blue")) if colours else ""
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
                   f"property double x\nproperty double y\nproperty double z\n{tint}"
                   f"element face {len(triangles)}\n"
                   "property list uchar int vertex_indices\nend_header\n".encode())
        for i, p in enumerate(vertices):
            file.write(struct.pack("<3d", *p))
            if colours:
                file.write(bytes(colours[i][:3]))
        for t in triangles:
            file.write(struct.pack("<B3i", 3, *t))
