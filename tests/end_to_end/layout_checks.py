# SPDX-License-Identifier: MIT
"""Checks what `rattan layout` writes, on purpose without any of Rattan's own code.

A layout is read from its OBJ or PLY file, or from what the stock draco_decoder makes of a Draco
file; the functions that look for problems return a list of sentences, empty when all is well.
"""

import json
import re
import subprocess
from collections import Counter, namedtuple
from fractions import Fraction
from pathlib import Path

import mesh_checks

# positions; uv: one a texture vertex; faces: of vertices; corners: of texture vertices, a face;
# part: one a face, into parts; parts: (chart, number within it), or None where the file has none.
Layout = namedtuple("Layout", "positions uv faces corners part parts")

MOST = 5  # problems of a kind that are told one by one


class Problems(list):
    def __init__(self):
        super().__init__()
        self.counts = Counter()

    def say(self, kind, detail=""):
        self.counts[kind] += 1
        if self.counts[kind] <= MOST:
            self.append(f"{kind}: {detail}" if detail else kind)
        elif self.counts[kind] == MOST + 1:
            self.append(f"{kind}: ... and more")


# ---- reading ----

def read_obj(path):
    """Of our own: groups say chart and part."""
    positions, uv, faces, corners, part, parts = [], [], [], [], [], []
    known = {}
    current = None
    with open(path, encoding="utf-8") as file:
        for line in file:
            kind, _, rest = line.partition(" ")
            if kind == "f":
                words = rest.split()
                pairs = [w.split("/") for w in words]
                assert all(len(p) >= 2 and p[1] for p in pairs), "a corner without coordinates"
                faces.append(tuple(int(p[0]) - 1 for p in pairs))
                corners.append(tuple(int(p[1]) - 1 for p in pairs))
                part.append(current)
            elif kind == "vt":
                uv.append(tuple(map(float, rest.split()[:2])))
            elif kind == "v":
                positions.append(tuple(map(float, rest.split()[:3])))
            elif kind == "g":
                name = re.fullmatch(r"chart_(\d+)(?:_part_(\d+))?", rest.strip())
                assert name, f"group {rest.strip()}"
                key = (int(name[1]), int(name[2] or 0))
                if key not in known:
                    known[key] = len(parts)
                    parts.append(key)
                current = known[key]
    return Layout(positions, uv, faces, corners, part, parts)


def read_ply(path):
    """Of our own: a texture vertex is what corners of a part share, vertex and coordinates."""
    read = mesh_checks.read_ply_elements(path)
    positions = [(r["x"], r["y"], r["z"]) for r in read["vertex"]]
    uv, faces, corners, part, parts, known = [], [], [], [], [], {}
    for r in read["face"]:
        faces.append(tuple(r["vertex_indices"]))
        triangle = []
        for k, v in enumerate(faces[-1]):
            key = (r["part"], v, r["texcoord"][2 * k], r["texcoord"][2 * k + 1])
            if key not in known:
                known[key] = len(uv)
                uv.append(key[2:])
            triangle.append(known[key])
        corners.append(tuple(triangle))
        assert r["part"] <= len(parts), "parts are numbered as they come"
        if r["part"] == len(parts):
            first = not parts or parts[-1][0] != r["chart"]
            parts.append((r["chart"], 0 if first else parts[-1][1] + 1))
        part.append(r["part"])
    return Layout(positions, uv, faces, corners, part, parts)


def read_drc(path, folder):
    """By the stock decoder: connections from its OBJ, which shares vertices but has six decimals;
    coordinates from its PLY, which has all bits but tears vertices at seams. Parts are what hangs
    together in texture coordinates; their charts are not known."""
    decoded = Path(folder) / "decoded_layout"
    for extension in (".obj", ".ply"):
        subprocess.run(["draco_decoder", "-i", path, "-o", decoded.with_suffix(extension)],
                       check=True, capture_output=True)
    positions, uv, faces, corners = [], [], [], []
    with open(decoded.with_suffix(".obj"), encoding="utf-8") as file:
        for line in file:
            kind, _, rest = line.partition(" ")
            if kind == "f":
                pairs = [w.split("/") for w in rest.split()]
                assert all(len(p) >= 2 and p[1] for p in pairs), "a corner without coordinates"
                faces.append(tuple(int(p[0]) - 1 for p in pairs))
                corners.append(tuple(int(p[1]) - 1 for p in pairs))
            elif kind == "vt":
                uv.append(tuple(map(float, rest.split()[:2])))
            elif kind == "v":
                positions.append(tuple(map(float, rest.split()[:3])))
    exact = mesh_checks.read_ply_elements(decoded.with_suffix(".ply"))["face"]
    assert len(exact) == len(faces), "the decoder's OBJ and PLY differ"
    for triangle, record in zip(corners, exact):
        for k, t in enumerate(triangle):
            p = tuple(record["texcoord"][2 * k : 2 * k + 2])
            assert max(abs(a - b) for a, b in zip(p, uv[t])) < 2e-6, "another order of faces"
            uv[t] = p
    pieces = mesh_checks.UnionFind(len(uv))
    for a, b, c in corners:
        pieces.union(a, b)
        pieces.union(b, c)
    number = {}
    part = [number.setdefault(pieces.find(a), len(number)) for a, _, _ in corners]
    return Layout(positions, uv, faces, corners, part, [None] * len(number))


def read_layout(path, folder=None):
    path = Path(path)
    if path.suffix == ".drc":
        return read_drc(path, folder or path.parent)
    return read_obj(path) if path.suffix == ".obj" else read_ply(path)


def read_transitions(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


# ---- the surface ----

def surface_problems(layout, components, loops, euler):
    """The whole triangulation, charts joined, is the scan's surface."""
    problems = Problems()
    directed = Counter()
    for f in layout.faces:
        if len(f) != 3 or len(set(f)) != 3:
            problems.say("a face that is no triangle", f)
        for k in range(3):
            directed[f[k], f[(k + 1) % 3]] += 1
    for edge, n in directed.items():
        if n > 1:
            problems.say("an edge used twice in one direction", edge)
    unused = len(layout.positions) - len({v for f in layout.faces for v in f})
    if unused:
        problems.say("unused vertices", unused)
    found = mesh_checks.topology(layout.faces)
    if found.vertices != len(layout.positions) - unused:
        problems.say("vertices where fans meet", found.vertices - len(layout.positions) + unused)
    if (found.components, found.loops, found.euler) != (components, loops, euler):
        problems.say("another surface than the scan's", f"{found}, not {components} components, "
                     f"{loops} loops, Euler characteristic {euler}")
    return problems


def disk(faces):
    found = mesh_checks.topology(faces)
    return (found.components, found.loops, found.euler) == (1, 1, 1)


def signed_area(a, b, c):
    """Twice the area; its sign is exact."""
    p, q = (b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])
    if abs(p - q) > 1e-12 * (abs(p) + abs(q)):
        return p - q
    a, b, c = ([Fraction(x) for x in point] for point in (a, b, c))
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def faces_by_part(layout):
    out = [[] for _ in layout.parts]
    for f, p in enumerate(layout.part):
        out[p].append(f)
    return out


def part_problems(layout):
    """Every corner has coordinates of its part alone; parts are disks; no triangle is folded."""
    problems = Problems()
    owner = {}
    for f, corners in enumerate(layout.corners):
        if len(corners) != 3:
            problems.say("a face without three texture vertices", f)
            continue
        for v, t in zip(layout.faces[f], corners):
            if not 0 <= t < len(layout.uv):
                problems.say("a corner without coordinates", f)
                return problems
            if owner.setdefault(t, (layout.part[f], v)) != (layout.part[f], v):
                problems.say("a texture vertex of two parts or two vertices", t)
        if signed_area(*(layout.uv[t] for t in corners)) <= 0:
            problems.say("a folded triangle", f"{f} of part {layout.part[f]}")
    if len(owner) != len(layout.uv):
        problems.say("unused texture vertices", len(layout.uv) - len(owner))
    for p, faces in enumerate(faces_by_part(layout)):
        if not disk([layout.corners[f] for f in faces]):
            problems.say("a part that is no disk", p)
    return problems


# ---- how parts meet ----

def turned(p, r):
    for _ in range(r % 4):
        p = (-p[1], p[0])
    return p


def unit_sides(transitions):
    """By (part, side, unit): the other one, turn, shift, strand; None on the boundary."""
    out = {}
    for t in transitions["transitions"]:
        a, b = (t["part_a"], t["side_a"], t["unit_a"]), (t["part_b"], t["side_b"], t["unit_b"])
        back = turned((-t["s"], -t["t"]), -t["turn"])
        for key, value in ((a, (b, t["turn"], (t["s"], t["t"]), t["strand"])),
                           (b, (a, -t["turn"] % 4, back, t["strand"]))):
            assert key not in out, f"{key} is glued twice"
            out[key] = value
    for t in transitions["boundary"]:
        key = (t["part"], t["side"], t["unit"])
        assert key not in out, f"{key} is glued and on the boundary"
        out[key] = None
    return out


def unit_side_of(p, q, length, tolerance):
    """(side, unit) that the edge from p to q runs along, counter-clockwise; None if none."""
    for side in range(4):
        a, b = ((p[0], p[1]), (q[0], q[1]))
        # Turn the square so that the side becomes the lower one.
        for _ in range(side):
            a, b = (a[1], length - a[0]), (b[1], length - b[0])
        if abs(a[1]) <= tolerance and abs(b[1]) <= tolerance and b[0] > a[0]:
            unit = int(0.5 * (a[0] + b[0]))
            if a[0] >= unit - tolerance and b[0] <= unit + 1 + tolerance and unit < length:
                return side, unit
    return None


def seams(layout):
    """Of every edge of the surface that two parts share, or the scan's boundary: (face, k, other
    face, other k), from corner k to the next; the other is None at the boundary."""
    at = {}
    for f, (a, b, c) in enumerate(layout.faces):
        at[a, b], at[b, c], at[c, a] = (f, 0), (f, 1), (f, 2)
    for (a, b), (f, k) in at.items():
        other = at.get((b, a))
        if other is None:
            yield f, k, None, None
        elif a < b:
            g, l = other
            c, d = layout.corners[f], layout.corners[g]
            if c[k] != d[(l + 1) % 3] or c[(k + 1) % 3] != d[l]:
                yield f, k, g, l


def continuity_problems(layout, transitions=None, tolerance=1e-9):
    """Point by point: along every edge between two parts the coordinates of one side become those
    of the other by a quarter turn and a whole translation; where `transitions` are given (and the
    layout says its parts), by the very one named there for that unit side. Then also: the edges of
    each unit side make up its whole length."""
    problems = Problems()
    sides = unit_sides(transitions) if transitions else None
    length = [p["length"] for p in transitions["parts"]] if transitions else None
    covered = Counter()
    for f, k, g, l in seams(layout):
        p = [layout.uv[layout.corners[f][(k + i) % 3]] for i in range(2)]
        where = f"faces {f} and {g}, parts {layout.part[f]} and {g and layout.part[g]}"
        if sides is not None:
            part = layout.part[f]
            found = unit_side_of(*p, length[part], tolerance)
            if found is None:
                problems.say("a seam that is on no side of its part", f"{where}: {p}")
                continue
            key = (part, *found)
            covered[key] += abs(p[1][0] - p[0][0]) + abs(p[1][1] - p[0][1])
            if key not in sides:
                problems.say("a unit side without transition", key)
                continue
            if (g is None) != (sides[key] is None):
                problems.say("a boundary that is glued, or the reverse", where)
                continue
        if g is None:
            continue
        q = [layout.uv[layout.corners[g][(l + 1 - i) % 3]] for i in range(2)]
        if sides is not None:
            other, turn, shift, _ = sides[key]
            if other[0] != layout.part[g]:
                problems.say("a transition into another part", f"{where}: {other}")
                continue
            back = unit_side_of(q[1], q[0], length[other[0]], tolerance)
            if back != other[1:]:
                problems.say("a transition onto another side", f"{where}: {other}, not {back}")
            covered[other] += abs(q[1][0] - q[0][0]) + abs(q[1][1] - q[0][1])
            choices = [(turn, shift)]
        else:
            choices = []
            for turn in range(4):
                r = turned(p[0], turn)
                choices.append((turn, tuple(round(q[0][i] - r[i]) for i in range(2))))
        worst = []
        for turn, shift in choices:
            off = [turned(p[i], turn)[j] + shift[j] - q[i][j] for i in range(2) for j in range(2)]
            worst.append(max(map(abs, off)))
        if min(worst) > tolerance:
            problems.say("coordinates that do not continue", f"{where}: off by {min(worst):.3g}")
    if sides is not None:
        for key in sides:
            if abs(covered[key] - 1) > 1e-6 + 100 * tolerance:
                problems.say("a unit side that its edges do not make up", f"{key}: {covered[key]}")
    return problems


def transition_problems(transitions):
    """The file on its own: every unit side is there; side upon side, backwards; corners of parts
    close up around every vertex."""
    problems = Problems()
    sides = unit_sides(transitions)
    length = [p["length"] for p in transitions["parts"]]
    for i, p in enumerate(transitions["parts"]):
        if p["part"] != i:
            problems.say("parts out of order", i)
        if p["length"] != (1 if p["kind"] == "split" else transitions["chart_side"]):
            problems.say("a part of another size", p)
    wanted = {(i, side, unit) for i, n in enumerate(length) for side in range(4)
              for unit in range(n)}
    for key in wanted ^ sides.keys():
        problems.say("a unit side that is missing or not there", key)

    def start(key):
        part, side, unit = key
        x, y = float(unit), 0.0
        for _ in range(side):
            x, y = length[part] - y, x
        return x, y

    def end(key):
        part, side, unit = key
        return start((part, side, unit + 1))

    def move(p, turn, shift):
        r = turned(p, turn)
        return r[0] + shift[0], r[1] + shift[1]

    for key, glued in sides.items():
        if glued is None:
            continue
        other, turn, shift, _ = glued
        if move(start(key), turn, shift) != end(other) or move(end(key), turn, shift) != start(other):
            problems.say("a transition that does not lay side on side", (key, glued))
    visited = set()
    for first in sides:
        if first in visited:
            continue
        key, quarters, path = first, 0, set()
        probe = (start(first)[0] + 0.5, start(first)[1] + 0.25)
        while True:
            path.add(key)
            part, side, unit = key
            quarters += 2 if unit else 1
            before = (part, side, unit - 1) if unit else (part, (side + 3) % 4,
                                                          length[part] - 1)
            if sides.get(before) is None:
                break
            key, turn, shift, _ = sides[before]
            probe = move(probe, turn, shift)
            if key == first:
                rest = turned((0.5, 0.25), -quarters)
                if (probe[0] - start(first)[0], probe[1] - start(first)[1]) != rest:
                    problems.say("transitions that do not close up around a vertex", first)
                break
            if key in path:
                problems.say("a walk around a vertex that does not come back", first)
                break
        visited |= path
    return problems


def chart_problems(layout, transitions):
    """Parts are those that the file says; every chart, its parts joined along the lines to its
    centre and nowhere else, is a disk."""
    problems = Problems()
    said = [(p["chart"], p["corner"]) for p in transitions["parts"]]
    if said != layout.parts:
        problems.say("other parts than the file of transitions says",
                     f"{len(layout.parts)} and {len(said)}")
        return problems
    if len({c for c, _ in said}) != transitions["charts"]:
        problems.say("another number of charts", transitions["charts"])
    sides = unit_sides(transitions)
    length = [p["length"] for p in transitions["parts"]]
    joined = mesh_checks.UnionFind(len(layout.uv))
    for f, k, g, l in seams(layout):
        if g is None or transitions["parts"][layout.part[f]]["kind"] != "split":
            continue
        p = [layout.uv[layout.corners[f][(k + i) % 3]] for i in range(2)]
        found = unit_side_of(*p, length[layout.part[f]], 1e-9)
        glued = sides.get((layout.part[f], *found)) if found else None
        if glued is not None and glued[3] is None:
            for i in range(2):
                joined.union(layout.corners[f][(k + i) % 3], layout.corners[g][(l + 1 - i) % 3])
    charts = {}
    for p, faces in enumerate(faces_by_part(layout)):
        charts.setdefault(layout.parts[p][0], []).extend(
            tuple(joined.find(t) for t in layout.corners[f]) for f in faces)
    for chart, faces in charts.items():
        if not disk(faces):
            problems.say("a chart that is no disk", chart)
    return problems


# ---- the base complex ----

def base_complex_problems(faces, vertex_count, components, loops, euler):
    """Quads alone; no face repeats a vertex, no two edges join the same vertices."""
    problems = Problems()
    directed = Counter()
    for f in faces:
        if len(f) != 4:
            problems.say("a face that is no quad", f)
        if len(set(f)) != len(f):
            problems.say("a face that repeats a vertex", f)
        for k, v in enumerate(f):
            directed[v, f[(k + 1) % len(f)]] += 1
    for edge, n in directed.items():
        if n > 1:
            problems.say("two edges that join the same vertices", edge)
    if vertex_count != len({v for f in faces for v in f}):
        problems.say("unused vertices", vertex_count)
    found = mesh_checks.topology(faces)
    if (found.components, found.loops, found.euler) != (components, loops, euler):
        problems.say("another surface than the scan's", f"{found}, not {components} components, "
                     f"{loops} loops, Euler characteristic {euler}")
    if found.vertices != vertex_count:
        problems.say("vertices where fans meet", found.vertices - vertex_count)
    return problems


def layout_problems(path, transitions_path, components, loops, euler, folder=None, step=0.0):
    """All of the above on one layout file. `step`: of a `.drc`, its quantisation step."""
    layout = read_layout(path, folder)
    transitions = read_transitions(transitions_path)
    problems = surface_problems(layout, components, loops, euler)
    problems += part_problems(layout)
    problems += transition_problems(transitions)
    if layout.parts and layout.parts[0] is not None:
        tolerance = 1e-9 if Path(path).suffix == ".obj" else 1e-6
        problems += chart_problems(layout, transitions)
        problems += continuity_problems(layout, transitions, tolerance)
    else:
        if len(layout.parts) != len(transitions["parts"]):
            problems.append(f"{len(layout.parts)} parts, not {len(transitions['parts'])}")
        problems += continuity_problems(layout, None, step or 1e-6)
    return problems
