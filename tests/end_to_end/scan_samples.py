# SPDX-License-Identifier: MIT
"""Small scans, whole and broken, as bytes. Everything is made here; nothing is random but by a
fixed seed."""

import math
import struct


# ---- shapes: (vertices, faces) ----

def torus(nu=24, nv=12, big=2.0, small=0.7):
    vertices, faces = [], []
    for u in range(nu):
        for v in range(nv):
            a, b = 2 * math.pi * u / nu, 2 * math.pi * v / nv
            r = big + small * math.cos(b)
            vertices.append((r * math.cos(a), r * math.sin(a), small * math.sin(b)))
    for u in range(nu):
        for v in range(nv):
            p, q, r, s = (u * nv + v, (u + 1) % nu * nv + v,
                          (u + 1) % nu * nv + (v + 1) % nv, u * nv + (v + 1) % nv)
            faces += [(p, q, r), (p, r, s)]
    return vertices, faces


def quad_torus(nu=24, nv=12):
    vertices, triangles = torus(nu, nv)
    faces = [(triangles[k][0], triangles[k][1], triangles[k][2], triangles[k + 1][2])
             for k in range(0, len(triangles), 2)]
    return vertices, faces


def sphere(n=12, radius=1.0, centre=(0, 0, 0)):
    vertices = [(0.0, 0.0, radius)]
    for i in range(1, n):
        for j in range(2 * n):
            a, b = math.pi * i / n, math.pi * j / n
            vertices.append((radius * math.sin(a) * math.cos(b),
                             radius * math.sin(a) * math.sin(b), radius * math.cos(a)))
    vertices.append((0.0, 0.0, -radius))
    at = lambda i, j: 1 + (i - 1) * 2 * n + j % (2 * n)
    faces = []
    for j in range(2 * n):
        faces.append((0, at(1, j), at(1, j + 1)))
        for i in range(1, n - 1):
            faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)),
                      (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
        faces.append((len(vertices) - 1, at(n - 1, j + 1), at(n - 1, j)))
    return [tuple(c + o for c, o in zip(p, centre)) for p in vertices], faces


def grid(nx, ny, height=lambda x, y: 0.0, sx=1.0, sy=1.0):
    vertices = [(sx * x, sy * y, height(x, y)) for y in range(ny + 1) for x in range(nx + 1)]
    faces = []
    for y in range(ny):
        for x in range(nx):
            a = y * (nx + 1) + x
            faces += [(a, a + 1, a + nx + 2), (a, a + nx + 2, a + nx + 1)]
    return vertices, faces


def tetrahedron(centre=(0, 0, 0), size=1.0):
    corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    return ([tuple(size * c + o for c, o in zip(p, centre)) for p in corners],
            [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])


def moebius(n=40, w=4):
    vertices, faces = [], []
    for u in range(n):
        for v in range(w + 1):
            a, t = 2 * math.pi * u / n, (v / w - 0.5) * 0.8
            r = 1 + t * math.cos(a / 2)
            vertices.append((r * math.cos(a), r * math.sin(a), t * math.sin(a / 2)))
    at = lambda u, v: u * (w + 1) + v if u < n else w - v
    for u in range(n):
        for v in range(w):
            faces += [(at(u, v), at(u + 1, v), at(u + 1, v + 1)),
                      (at(u, v), at(u + 1, v + 1), at(u, v + 1))]
    return vertices, faces


def joined(*meshes):
    vertices, faces = [], []
    for v, f in meshes:
        n = len(vertices)
        vertices += v
        faces += [tuple(i + n for i in face) for face in f]
    return vertices, faces


def moved(mesh, scale=(1, 1, 1), by=(0, 0, 0)):
    return [tuple(s * c + o for c, s, o in zip(p, scale, by)) for p in mesh[0]], mesh[1]


def soup(mesh):
    vertices = [mesh[0][i] for f in mesh[1] for i in f]
    return vertices, [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(len(mesh[1]))]


# ---- files ----

def obj(mesh, form="{}", eol="\n", base=1):
    lines = ["v " + " ".join(map(repr, p)) for p in mesh[0]]
    lines += ["f " + " ".join(form.format(i + base) for i in f) for f in mesh[1]]
    return (eol.join(lines) + eol).encode()


def off(mesh, keyword="OFF", tail="", eol="\n"):
    lines = [keyword, f"{len(mesh[0])} {len(mesh[1])} 0"]
    lines += [" ".join(map(repr, p)) + tail for p in mesh[0]]
    lines += [" ".join(map(str, (len(f),) + f)) for f in mesh[1]]
    return (eol.join(lines) + eol).encode()


def ascii_ply(mesh, eol="\n", vertices=None, faces=None):
    lines = ["ply", "format ascii 1.0", "obj_info made by a test",
             f"element vertex {len(mesh[0]) if vertices is None else vertices}",
             "property float x", "property float y", "property float z",
             f"element face {len(mesh[1]) if faces is None else faces}",
             "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, p)) for p in mesh[0]]
    lines += [" ".join(map(str, (len(f),) + tuple(f))) for f in mesh[1]]
    return (eol.join(lines) + eol).encode()


def binary_ply(mesh, order="<", kind="f", index="i", count="B", vertices=None, faces=None):
    names = {"f": "float", "d": "double", "i": "int", "I": "uint", "H": "ushort", "h": "short",
             "B": "uchar"}
    head = (f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\n"
            f"element vertex {len(mesh[0]) if vertices is None else vertices}\n"
            + "".join(f"property {names[kind]} {c}\n" for c in "xyz")
            + f"element face {len(mesh[1]) if faces is None else faces}\n"
            f"property list {names[count]} {names[index]} vertex_indices\nend_header\n")
    body = b"".join(struct.pack(f"{order}3{kind}", *p) for p in mesh[0])
    body += b"".join(struct.pack(f"{order}{count}{len(f)}{index}", len(f), *f) for f in mesh[1])
    return head.encode() + body


def binary_stl(mesh, title=b"", count=None):
    data = title.ljust(80, b"\0") + struct.pack("<I", len(mesh[1]) if count is None else count)
    for f in mesh[1]:
        data += struct.pack("<12fH", 0, 0, 0, *(c for i in f for c in mesh[0][i]), 0)
    return data


def ascii_stl(mesh, eol="\n", name="part"):
    lines = [f"solid {name}"]
    for f in mesh[1]:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(repr, mesh[0][i])) for i in f]
        lines += ["endloop", "endfacet"]
    return (eol.join(lines + [f"endsolid {name}"]) + eol).encode()


def zstd_frame(data):
    """Stored, not compressed: enough for the format."""
    out = b"\x28\xb5\x2f\xfd" + b"\x00" + b"\x58"
    blocks = [data[k : k + 100000] for k in range(0, len(data), 100000)] or [b""]
    for k, block in enumerate(blocks):
        out += struct.pack("<I", len(block) << 3 | (k + 1 == len(blocks)))[:3] + block
    return out


def draco_header(faces, points, method=1):
    """The beginning of a Draco file that declares these counts, and a little more."""
    def varint(n):
        out = b""
        while n > 127:
            out += bytes([n & 127 | 128])
            n >>= 7
        return out + bytes([n])
    head = b"DRACO\x02\x02\x01" + bytes([method]) + b"\0\0"
    counts = varint(points) + varint(faces) if method == 1 else varint(faces) + varint(points)
    return head + (b"\0" if method == 1 else b"") + counts + b"\0" * 64
