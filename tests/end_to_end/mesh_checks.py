# SPDX-License-Identifier: MIT
"""Reading meshes and checking their topology, on purpose without any of Rattan's own code."""

import struct
from collections import Counter, namedtuple

Topology = namedtuple("Topology", "vertices edges faces components loops euler")


def read_obj(path):
    vertices, faces = [], []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append(tuple(float(w) for w in words[1:4]))
            elif words[0] == "f":
                corners = [int(w.split("/")[0]) for w in words[1:]]
                faces.append(tuple(c - 1 if c > 0 else len(vertices) + c for c in corners))
    return vertices, faces


def read_off(path):
    with open(path, encoding="utf-8") as file:
        words = [w for line in file for w in line.split("#")[0].split()]
    assert words[0].endswith("OFF")
    v, f = int(words[1]), int(words[2])
    at, each = 4, 7 if words[0] == "COFF" else 3
    vertices = [tuple(map(float, words[at + each * i : at + each * i + 3])) for i in range(v)]
    at += each * v
    faces = []
    for _ in range(f):
        n = int(words[at])
        faces.append(tuple(map(int, words[at + 1 : at + 1 + n])))
        at += 1 + n
    return vertices, faces


PLY_TYPES = {
    "char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h",
    "ushort": "H", "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I",
    "float": "f", "float32": "f", "double": "d", "float64": "d",
}


def read_ply_elements(path):
    """Lists of records (dictionaries) by the name of their element."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header")
    end = data.index(b"\n", end) + 1
    elements, form = [], None
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if form == "ascii":
        words = iter(data[end:].split())
        take = lambda kind: float(next(words)) if kind in "fd" else int(next(words))
    else:
        order = "<" if "little" in form else ">"
        at = [end]

        def take(kind):
            value = struct.unpack_from(order + kind, data, at[0])[0]
            at[0] += struct.calcsize(kind)
            return value

    read = {}
    for name, count, properties in elements:
        rows = read.setdefault(name, [])
        for _ in range(count):
            record = {}
            for p in properties:
                if p[0] == "list":
                    n = take(PLY_TYPES[p[1]])
                    record[p[3]] = [take(PLY_TYPES[p[2]]) for _ in range(n)]
                else:
                    record[p[1]] = take(PLY_TYPES[p[0]])
            rows.append(record)
    return read


def read_ply(path):
    read = read_ply_elements(path)
    vertices = [(r["x"], r["y"], r["z"]) for r in read["vertex"]]
    faces = [tuple(r.get("vertex_indices") or r.get("vertex_index")) for r in read["face"]]
    return vertices, faces


def read_mesh(path):
    reader = {"obj": read_obj, "off": read_off, "ply": read_ply}[str(path).rsplit(".", 1)[1]]
    return reader(path)


class UnionFind:
    def __init__(self, n):
        self.parent = list(range(n))

    def find(self, a):
        parent = self.parent
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        return a

    def union(self, a, b):
        a, b = self.find(a), self.find(b)
        if a != b:
            self.parent[max(a, b)] = min(a, b)


def topology(faces):
    """Of the surface that the faces make once non-manifold edges and vertices are cut open."""
    faces = [f for f in faces if len(set(f)) == len(f)]
    seen, unique = set(), []
    for f in faces:
        key = tuple(sorted(f))
        if len(f) > 3 or key not in seen:
            seen.add(key)
            unique.append(f)
    faces = unique
    begin, corners = [], 0
    for f in faces:
        begin.append(corners)
        corners += len(f)
    sides = {}
    for f, face in enumerate(faces):
        n = len(face)
        for k in range(n):
            a, b = face[k], face[(k + 1) % n]
            sides.setdefault((min(a, b), max(a, b)), []).append((f, k, a < b))
    fans, pieces = UnionFind(corners), UnionFind(len(faces))
    edges, open_sides = 0, []
    for uses in sides.values():
        if len(uses) == 2 and uses[0][2] != uses[1][2]:
            edges += 1
            (f, k, _), (g, l, _) = uses
            pieces.union(f, g)
            fans.union(begin[f] + k, begin[g] + (l + 1) % len(faces[g]))
            fans.union(begin[f] + (k + 1) % len(faces[f]), begin[g] + l)
        else:
            edges += len(uses)
            open_sides += [(f, k) for f, k, _ in uses]
    vertices = len({fans.find(c) for c in range(corners)})
    components = len({pieces.find(f) for f in range(len(faces))})
    leaving = {}
    ends = []
    for f, k in open_sides:
        start = fans.find(begin[f] + k)
        assert start not in leaving, "a fan has two boundary sides"
        leaving[start] = len(ends)
        ends.append(fans.find(begin[f] + (k + 1) % len(faces[f])))
    loops, visited = 0, set()
    for side in range(len(ends)):
        if side in visited:
            continue
        loops += 1
        while side not in visited:
            visited.add(side)
            side = leaving[ends[side]]
    return Topology(vertices, edges, len(faces), components, loops, vertices - edges + len(faces))


def violations(faces, vertex_count=None):
    """What a remesh must not have, as a dictionary of counts; empty when all is well."""
    found = Counter()
    directed = Counter()
    neighbours = {}
    for f in faces:
        if len(set(f)) != len(f):
            found["repeated vertex in a face"] += 1
        for k in range(len(f)):
            directed[(f[k], f[(k + 1) % len(f)])] += 1
            neighbours.setdefault(f[k], set()).update((f[k - 1], f[(k + 1) % len(f)]))
    found["edge used twice in one direction"] = sum(1 for n in directed.values() if n > 1)
    boundary = {v for (a, b) in directed if (b, a) not in directed for v in (a, b)}
    found["two faces on the same vertices"] = sum(
        n - 1 for n in Counter(tuple(sorted(f)) for f in faces).values())
    found["interior vertex of valence two"] = sum(
        1 for v, around in neighbours.items() if v not in boundary and len(around) <= 2)
    cut = topology(faces)
    found["non-manifold vertex"] = cut.vertices - len(neighbours)
    if vertex_count is not None:
        found["unused vertex"] = vertex_count - len(neighbours)
    found["face with more than four corners"] = sum(1 for f in faces if len(f) > 4)
    return {name: n for name, n in found.items() if n}
