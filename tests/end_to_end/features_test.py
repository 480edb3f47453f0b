# SPDX-License-Identifier: MIT
"""Sharp edges, corners and boundaries come back where they were."""

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import feature_checks
import mesh_checks

RATTAN = os.environ["RATTAN"]
DATA = os.environ.get("RATTAN_DATA")


class Builder:
    """Triangles over shared vertices, welded at equal positions."""

    def __init__(self):
        self.vertices, self.faces, self.number = [], [], {}

    def vertex(self, p):
        key = tuple(round(x, 9) for x in p)
        if key not in self.number:
            self.number[key] = len(self.vertices)
            self.vertices.append(tuple(p))
        return self.number[key]

    def patch(self, place, rows, columns, keep=lambda i, j: True):
        """place(s, t) over the unit square, seen from where s x t points."""
        ids = {}

        def at(i, j):
            if (i, j) not in ids:
                ids[i, j] = self.vertex(place(i / rows, j / columns))
            return ids[i, j]

        for i in range(rows):
            for j in range(columns):
                if keep(i, j):
                    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
                    pair = [(a, b, c), (a, c, d)] if (i + j) % 2 else [(a, b, d), (b, c, d)]
                    self.faces += [f for f in pair if len(set(f)) == 3]

    def write(self, path):
        with open(path, "w", encoding="utf-8") as file:
            for v in self.vertices:
                file.write("v %.9g %.9g %.9g\n" % v)
            for f in self.faces:
                file.write("f %d %d %d\n" % tuple(i + 1 for i in f))


def box(size, steps):
    b = Builder()
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            def place(s, t, axis=axis, side=side, u=u, v=v):
                p = [0.0, 0.0, 0.0]
                p[axis] = size[axis] * side
                p[u], p[v] = (s * size[u], t * size[v]) if side else (t * size[u], s * size[v])
                return p
            n = (steps[u], steps[v]) if side else (steps[v], steps[u])
            b.patch(place, *n)
    return b


def cylinder(radius, height, around, up, rings):
    b = Builder()
    turn = lambda s: (math.cos(2 * math.pi * (s % 1.0)), math.sin(2 * math.pi * (s % 1.0)))
    b.patch(lambda s, t: (radius * turn(s)[0], radius * turn(s)[1], height * t), around, up)
    for z, flip in ((height, False), (0.0, True)):
        def place(s, t, z=z, flip=flip):
            if flip:
                s, t = t, s
            c = turn(s)
            return (radius * t * c[0], radius * t * c[1], z)
        # s x t points down; the cap at the top is seen from above.
        if flip:
            b.patch(lambda s, t, z=z: (radius * s * turn(1 - t)[0], -radius * s * turn(1 - t)[1] * -1,
                                       z), rings, around)
        else:
            b.patch(lambda s, t, z=z: (radius * s * turn(t)[0], radius * s * turn(t)[1], z), rings,
                    around)
    return b


def l_plate(n):
    """A flat L of unit squares with a square hole, open: all its features are boundary."""
    b = Builder()

    def keep(i, j):
        in_l = i < n or j < n
        hole = n // 4 <= i < 3 * n // 4 and n // 4 <= j < 3 * n // 4
        return in_l and not hole

    b.patch(lambda s, t: (2.0 * s, 2.0 * t, 0.0), 2 * n, 2 * n, keep)
    return b


def plate_with_windows(n):
    """A square of n^2 windows, each a third as wide as the distance from one to the next."""
    b = Builder()
    b.patch(lambda s, t: (s, t, 0.0), 9 * n, 9 * n,
            lambda i, j: not (3 <= i % 9 < 6 and 3 <= j % 9 < 6))
    return b


def l_block(n):
    """A solid L: convex and concave edges, faces with six corners."""
    b = Builder()
    inside = lambda x, y, z: (0 <= x < 2 * n and 0 <= y < 2 * n and 0 <= z < n and
                              (x < n or y < n))
    h = 1.0 / n
    for x in range(-1, 2 * n + 1):
        for y in range(-1, 2 * n + 1):
            for z in range(-1, n + 1):
                if not inside(x, y, z):
                    continue
                for axis in range(3):
                    for side in (0, 1):
                        other = [x, y, z]
                        other[axis] += 1 if side else -1
                        if inside(*other):
                            continue
                        u, v = (axis + 1) % 3, (axis + 2) % 3
                        quad = []
                        for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
                            p = [x, y, z]
                            p[axis] += side
                            p[u] += du
                            p[v] += dv
                            quad.append(b.vertex([c * h for c in p]))
                        if not side:
                            quad.reverse()
                        b.faces += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    return b


class Features(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def remesh(self, scan, *options):
        out, report = self.folder / "out.obj", self.folder / "report.json"
        done = subprocess.run([RATTAN, "remesh", str(scan), "-o", str(out), "--quiet", "--report",
                               str(report), *map(str, options)], capture_output=True, text=True,
                              timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        return mesh_checks.read_obj(out), json.loads(report.read_text())

    def check(self, scan, *options, degrees=40.0, least=0.1, within=1e-3):
        """Every sharp edge and boundary of the scan lies within a share of the diagonal of the
        remesh's edges. Returns both meshes."""
        vertices, faces = mesh_checks.read_mesh(scan)
        faces = [tuple(f) for f in faces]
        (w, g), report = self.remesh(scan, *options)
        self.assertEqual(mesh_checks.violations(g, len(w)), {})
        before, after = mesh_checks.topology(faces), mesh_checks.topology(g)
        for name in ("components", "loops", "euler"):
            self.assertEqual(getattr(after, name), getattr(before, name), name)
        size = feature_checks.diagonal(vertices)
        boundary, sharp = feature_checks.feature_edges(vertices, faces, degrees)
        sharp = feature_checks.long_components(vertices, sharp, least * size)
        found = feature_checks.Segments(w, list(feature_checks.edges(g)), 0.01 * size)
        far = feature_checks.farthest(vertices, sharp + boundary, found)
        self.assertLess(far, within * size)
        rim, _ = feature_checks.feature_edges(w, g, degrees)
        if rim:
            loops = feature_checks.Segments(vertices, boundary, 0.01 * size)
            self.assertLess(feature_checks.farthest(w, rim, loops), within * size)
        return (vertices, faces), (w, g), report

    def check_loops(self, scan, remesh, within=1e-3, most_zigzag=0.15):
        """Every boundary loop that doesn't zigzag more than this lies within a share of the
        diagonal of a loop of the remesh, and the other way round."""
        (v, f), (w, g) = scan, remesh
        size = feature_checks.diagonal(v)
        center = lambda points: [sum(p[k] for p in points) / len(points) for k in range(3)]
        ours = [(center([w[i] for i in loop]), loop) for loop in feature_checks.boundary_loops(g)]
        checked = 0
        for loop in feature_checks.boundary_loops(f):
            points = [v[i] for i in loop]
            if feature_checks.zigzag(points) > most_zigzag:
                continue
            c = center(points)
            ours.sort(key=lambda o: math.dist(o[0], c))
            there, back = feature_checks.loop_edges(loop), feature_checks.loop_edges(ours[0][1])
            for a, x, b, y in ((v, there, w, back), (w, back, v, there)):
                found = feature_checks.Segments(b, y, 0.01 * size)
                self.assertLess(feature_checks.farthest(a, x, found), within * size)
            checked += 1
        return checked

    def written(self, builder, name="scan.obj"):
        path = self.folder / name
        builder.write(path)
        return path

    def assert_kept(self, corners, vertices, within):
        for c in corners:
            self.assertLess(min(math.dist(c, v) for v in vertices), within, c)

    def test_box(self):
        size = (3.0, 2.0, 1.0)
        scan = self.written(box(size, (36, 24, 12)))
        for faces in (150, 400):
            with self.subTest(faces=faces):
                _, (w, g), report = self.check(scan, "--faces", faces, "--density", 1,
                                               within=1e-6)
                corners = [(x, y, z) for x in (0, 3) for y in (0, 2) for z in (0, 1)]
                self.assert_kept(corners, w, 1e-6)
                self.assertEqual(report["output"]["triangles"], 0)
                # Each vertex lies on the box, and each face in one of its planes.
                for f in g:
                    self.assertTrue(any(
                        all(abs(w[v][k] - at) < 1e-6 for v in f)
                        for k in range(3) for at in (0.0, size[k])))

    def test_box_without_features(self):
        scan = self.written(box((1.0, 1.0, 1.0), (16, 16, 16)))
        (w, _), _ = self.remesh(scan, "--crease", "off", "--faces", 100)
        self.assertTrue(w)

    def test_cylinder(self):
        scan = self.written(cylinder(1.0, 2.0, 96, 24, 14))
        _, (w, _), report = self.check(scan, "--faces", 500, within=2e-3)
        for x, y, z in w:
            self.assertLess(z, 2.0 + 1e-3)
            self.assertGreater(z, -1e-3)

    def test_plate_with_hole(self):
        scan = self.written(l_plate(24))
        _, (w, _), report = self.check(scan, "--faces", 250, "--density", 1, within=1e-6)
        corners = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]
        corners += [(x, y, 0) for x in (0.25, 0.75) for y in (0.25, 0.75)]
        self.assert_kept(corners, w, 1e-6)
        self.assertEqual(report["output"]["triangles"], 0)

    def test_windows_of_a_quad(self):
        n = 4
        builder = plate_with_windows(n)
        scan = self.written(builder)
        for faces in (120, 200, 800):
            with self.subTest(faces=faces):
                (w, g), report = self.remesh(scan, "--faces", faces)
                self.assertEqual(mesh_checks.violations(g, len(w)), {})
                g = [tuple(f) for f in g]
                self.assertEqual(self.check_loops((builder.vertices, builder.faces), (w, g)),
                                 n * n + 1)
                self.assert_kept([((9 * i + a) / (9 * n), (9 * j + b) / (9 * n), 0.0)
                                  for i in range(n) for j in range(n)
                                  for a in (3, 6) for b in (3, 6)], w, 1e-6)

    def test_block_with_concave_edge(self):
        scan = self.written(l_block(12))
        _, (w, _), report = self.check(scan, "--faces", 350, "--density", 1, within=1e-6)
        corners = [(x, y, z) for z in (0, 1)
                   for x, y in ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))]
        self.assert_kept(corners, w, 1e-6)
        self.assertGreater(report["output"]["quads"], 0.95 * report["output"]["faces"])

    def test_same_bytes_for_any_thread_count(self):
        scan = self.written(l_block(16))
        outputs = []
        for threads in (1, 3):
            self.remesh(scan, "--threads", threads)
            outputs.append((self.folder / "out.obj").read_bytes())
        self.assertEqual(outputs[0], outputs[1])

    def test_bad_angles(self):
        scan = self.written(box((1.0, 1.0, 1.0), (4, 4, 4)))
        for words in ("1", "180", "sharp"):
            done = subprocess.run([RATTAN, "remesh", str(scan), "-o", str(self.folder / "o.obj"),
                                   "--crease", words], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)

    @unittest.skipUnless(DATA, "RATTAN_DATA is not set")
    def test_sample_scans(self):
        with self.subTest(scan="fandisk"):
            self.check(Path(DATA) / "fandisk.obj", "--faces", 636)
        for ratio in (0.05, 0.1):
            with self.subTest(scan="plane_holes", ratio=ratio):
                scan = Path(DATA) / "plane_holes.obj"
                # The more faces, the more of its uneven edges there is room for.
                before, (w, g), report = self.check(scan, "--ratio", ratio,
                                                    degrees=60.0 if ratio == 0.1 else 180.0)
                loops = self.check_loops(before, (w, [tuple(f) for f in g]), most_zigzag=math.inf)
                self.assertEqual(loops, 27)
                self.assertTrue(report["output"]["target_met"])
        with self.subTest(scan="plane_holes", ratio=0.3):
            scan = Path(DATA) / "plane_holes.obj"
            before, (w, g), _ = self.check(scan, "--ratio", 0.3)
            self.assertEqual(
                self.check_loops(before, (w, [tuple(f) for f in g]), most_zigzag=math.inf), 27)
        for ratio in (0.05, 0.1):
            with self.subTest(scan="fandisk", ratio=ratio):
                _, _, report = self.check(Path(DATA) / "fandisk.obj", "--ratio", ratio)
                self.assertTrue(report["output"]["target_met"])


if __name__ == "__main__":
    if not DATA:
        print("RATTAN_DATA is not set: the tests on sample scans are skipped", file=sys.stderr)
    unittest.main(verbosity=2)
