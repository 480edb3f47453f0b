# SPDX-License-Identifier: MIT
"""Georeferenced scans and vertex colours, through every output format."""

import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import mesh_checks
import odd_meshes

RATTAN = os.environ["RATTAN"]
FAR = (4.5e6, 5.5e6, 120.0)
MILLIMETRE = 1e-3


def ridged_cube(n=40):
    """A cube of a metre with well rounded edges; ridges a millimetre high run over all its sides."""
    vertices, triangles = odd_meshes.box(n, (2, 2, 2))

    def place(p):
        x = [c - 1 for c in p]
        size = sum(abs(c) ** 4 for c in x) ** 0.25
        relief = MILLIMETRE * math.sin(9 * x[0]) * math.sin(9 * x[1] + 1) * math.sin(9 * x[2] + 2)
        return tuple(c * (0.5 / size + relief) for c in x)

    return [place(p) for p in vertices], triangles


class Coordinates(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def remesh(self, scan, output, *options):
        report = self.folder / "report.json"
        done = subprocess.run([RATTAN, "remesh", scan, "-o", self.folder / output, "--quiet",
                               "--report", report, *options],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(report.read_text())

    def read(self, name, origin):
        """Positions in full coordinates, and faces, by other means than Rattan's."""
        path = self.folder / name
        if path.suffix == ".drc":
            subprocess.run(["draco_decoder", "-i", path, "-o", self.folder / "decoded.obj"],
                           check=True, capture_output=True)
            path = self.folder / "decoded.obj"
        vertices, faces = mesh_checks.read_mesh(path)
        shift = origin if name.endswith(".drc") else (0, 0, 0)
        return [tuple(x + s for x, s in zip(p, shift)) for p in vertices], faces

    def test_a_far_scan_keeps_its_detail(self):
        near, far = self.folder / "near.ply", self.folder / "far.ply"
        cube = ridged_cube()
        odd_meshes.write_ply(near, cube)
        odd_meshes.write_ply(far, odd_meshes.moved(cube, FAR))
        unmoved = self.remesh(near, "near.ply", "--faces", "8000")
        expected, _ = self.read("near.ply", None)
        off = self.distances(expected[::3], cube)
        most, mean = max(off), sum(off) / len(off)
        self.assertLess(mean, 0.2 * MILLIMETRE)
        self.assertLess(sorted(off)[len(off) * 9 // 10], 0.5 * MILLIMETRE)
        full = {}
        for extension in ("drc", "obj", "ply", "off"):
            with self.subTest(extension=extension):
                report = self.remesh(far, "far." + extension, "--faces", "8000")
                origin = report["output"]["origin"]
                if extension == "drc":
                    self.assertTrue(all(abs(o - f) < 10 for o, f in zip(origin[:2], FAR)), origin)
                    info = subprocess.run([RATTAN, "info", self.folder / "far.drc"],
                                          capture_output=True, text=True, timeout=20)
                    self.assertIn("origin", info.stdout)
                vertices, faces = self.read("far." + extension, origin)
                self.assertEqual(mesh_checks.violations(faces, len(vertices)), {})
                # The last bits differ from the unmoved scan's, so vertices may lie elsewhere on the
                # surface; it is the surface that must be the same.
                off = self.distances([tuple(x - f for x, f in zip(p, FAR))
                                      for p in vertices[::3]], cube)
                self.assertLess(max(off), max(1.5 * most, 0.1 * MILLIMETRE))
                self.assertLess(sum(off) / len(off), 1.1 * mean + 0.01 * MILLIMETRE)
                for name in ("from_input_rms", "to_input_rms"):
                    self.assertLess(report["distance"][name],
                                    1.1 * unmoved["distance"][name] + 0.01 * MILLIMETRE)
                full[extension] = vertices
        # Text and binary hold the same doubles.
        self.assertEqual(full["obj"], full["ply"])
        self.assertEqual(full["obj"], full["off"])

    def distances(self, points, mesh):
        """From each point to the nearest of the triangles around its nearest vertices."""
        vertices, triangles = mesh
        cell = 0.05
        bins = {}
        for t, corners in enumerate(triangles):
            low = [min(vertices[c][k] for c in corners) for k in range(3)]
            high = [max(vertices[c][k] for c in corners) for k in range(3)]
            ranges = [range(math.floor(a / cell), math.floor(b / cell) + 1) for a, b in zip(low, high)]
            for i in ranges[0]:
                for j in ranges[1]:
                    for k in ranges[2]:
                        bins.setdefault((i, j, k), []).append(t)
        found = []
        for p in points:
            at = [math.floor(x / cell) for x in p]
            best = math.inf
            for i in (-1, 0, 1):
                for j in (-1, 0, 1):
                    for k in (-1, 0, 1):
                        for t in bins.get((at[0] + i, at[1] + j, at[2] + k), ()):
                            best = min(best, distance(p, *(vertices[c] for c in triangles[t])))
            found.append(best)
        return found

    def test_colours_follow_the_surface(self):
        sphere = odd_meshes.sphere(60, 30)
        linear = lambda p: [min(255, max(0, round(127.5 + 100 * x))) for x in p]
        scan = self.folder / "scan.ply"
        odd_meshes.write_ply(scan, sphere, [linear(p) for p in sphere[0]])
        for extension in ("obj", "ply", "off"):
            with self.subTest(extension=extension):
                self.remesh(scan, "out." + extension, "--faces", "800")
                points = coloured_points(self.folder / ("out." + extension))
                self.check_colours(points, 3)
        self.remesh(scan, "out.drc", "--faces", "800")
        # As polygons in OBJ, which the stock decoder writes without colours, and as PLY with them.
        vertices, faces = self.read("out.drc", (0, 0, 0))
        self.assertGreater(sum(len(f) == 4 for f in faces), 0.9 * len(faces))
        self.assertEqual(mesh_checks.violations(faces, len(vertices)), {})
        subprocess.run(["draco_decoder", "-i", self.folder / "out.drc", "-o",
                        self.folder / "decoded.ply"], check=True, capture_output=True)
        self.check_colours(coloured_points(self.folder / "decoded.ply"), 3)
        # And on from there.
        self.remesh(self.folder / "out.ply", "again.ply", "--faces", "300")
        self.check_colours(coloured_points(self.folder / "again.ply"), 5)

    def check_colours(self, points, tolerance):
        self.assertGreater(len(points), 200)
        for p, colour in points:
            for x, c in zip(p, colour):
                self.assertLessEqual(abs(127.5 + 100 * x - c), tolerance, (p, colour))

    def test_a_scan_without_colours_gives_none(self):
        scan = self.folder / "scan.ply"
        odd_meshes.write_ply(scan, odd_meshes.sphere())
        self.remesh(scan, "out.ply")
        self.assertNotIn(b"red", (self.folder / "out.ply").read_bytes()[:500])


def distance(p, a, b, c):
    """From a point to a triangle."""
    sub = lambda u, v: (u[0] - v[0], u[1] - v[1], u[2] - v[2])
    dot = lambda u, v: u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d00, d01, d11, d20, d21 = dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac)
    area = d00 * d11 - d01 * d01
    if area > 0:
        v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
        if v >= 0 and w >= 0 and v + w <= 1:
            off = [ap[k] - v * ab[k] - w * ac[k] for k in range(3)]
            return math.sqrt(dot(off, off))
    best = math.inf
    for s, e in ((a, b), (b, c), (c, a)):
        d, q = sub(e, s), sub(p, s)
        t = min(1.0, max(0.0, dot(q, d) / dot(d, d))) if dot(d, d) > 0 else 0.0
        off = [q[k] - t * d[k] for k in range(3)]
        best = min(best, math.sqrt(dot(off, off)))
    return best


def coloured_points(path):
    """(position, (red, green, blue)) of each vertex, colours from 0 to 255."""
    if path.suffix == ".ply":
        rows = mesh_checks.read_ply_elements(path)["vertex"]
        return [((r["x"], r["y"], r["z"]), (r["red"], r["green"], r["blue"])) for r in rows]
    found = []
    for line in path.read_text().splitlines():
        words = line.split()
        if path.suffix == ".obj" and words[0] == "v":
            numbers = list(map(float, words[1:]))
            found.append((numbers[:3], [255 * c for c in numbers[3:6]]))
        elif path.suffix == ".off" and len(words) == 7:
            numbers = list(map(float, words))
            found.append((numbers[:3], numbers[3:6]))
    return found


if __name__ == "__main__":
    unittest.main(verbosity=2)
