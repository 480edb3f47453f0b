# SPDX-License-Identifier: MIT
"""rattan compare from outside: names in the JSON, known answers, exit codes, sentences."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]

FIGURES = {
    "rattan": {"version", "commit"},
    "remesh": {"path", "vertices", "edges", "faces", "quads", "triangles", "quad_share",
               "interior_vertices", "irregular_vertices", "irregular_share",
               "mean_scaled_jacobian", "min_scaled_jacobian", "mean_corner_deviation",
               "mean_edge_length", "edge_length_variation", "components", "boundary_loops",
               "euler", "defects"},
    "scan": {"path", "vertices", "triangles", "components", "boundary_loops", "euler", "diagonal",
             "area"},
    "distance": {"remesh_to_scan", "scan_to_remesh"},
}
DEFECTS = {"non_manifold_edges", "inconsistent_edges", "non_manifold_vertices",
           "repeated_vertices", "duplicate_faces", "interior_valence_two", "inverted_quads",
           "other_degrees", "short_loops", "unused_vertices"}
WAYS = {"mean", "rms", "p99", "max", "points", "samples"}


def rattan(*words):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=120)


def obj(vertices, faces):
    lines = ["v {!r} {!r} {!r}".format(*map(float, v)) for v in vertices]
    return "\n".join(lines + ["f " + " ".join(str(i + 1) for i in f) for f in faces]) + "\n"


CUBE = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
CUBE_QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def grid(n, height):
    vertices = [(i / n, j / n, height) for j in range(n + 1) for i in range(n + 1)]
    at = lambda i, j: j * (n + 1) + i
    quads = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
             for j in range(n) for i in range(n)]
    return vertices, quads


class Compare(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def compare(self, a, b, *options):
        done = rattan("compare", a, b, "--json", "-", "--samples", 30000, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_names_and_agreement_with_the_report(self):
        scan, out, report = (self.folder / n for n in ("scan.ply", "out.drc", "report.json"))
        rattan("synth", "-o", scan, "--triangles", 20000, "--holes", 2, "--quiet")
        done = rattan("remesh", scan, "-o", out, "--quiet", "--report", report)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(report.read_text())
        found = self.compare(out, scan)
        for group, names in FIGURES.items():
            self.assertEqual(set(found[group]), names)
        self.assertEqual(set(found["remesh"]["defects"]), DEFECTS)
        self.assertFalse(any(found["remesh"]["defects"].values()))
        self.assertIs(found["same_topology"], True)
        for way in found["distance"].values():
            self.assertEqual(set(way), WAYS)
            self.assertLess(0, way["mean"])
            self.assertLess(way["mean"], way["rms"])
            self.assertLess(way["rms"], way["p99"])
            self.assertLess(way["p99"], way["max"])
        for name in ("faces", "quads", "interior_vertices", "irregular_vertices", "euler",
                     "boundary_loops"):
            self.assertEqual(found["remesh"][name], report["output"][name], name)
        # The file's grid moves vertices a little.
        self.assertAlmostEqual(found["remesh"]["mean_scaled_jacobian"],
                               report["output"]["mean_scaled_jacobian"], places=3)
        percent = 100 / report["distance"]["diagonal"]
        self.assertLess(percent * report["distance"]["from_input_mean"],
                        2 * found["distance"]["scan_to_remesh"]["mean"])
        self.assertLessEqual(report["distance"]["from_input_p99"],
                             report["distance"]["from_input_max"])
        text = rattan("compare", out, scan, "--json", self.folder / "figures.json",
                      "--samples", 30000)
        self.assertIn("scan to remesh", text.stdout)
        again = json.loads((self.folder / "figures.json").read_text())
        self.assertEqual(again, found)
        for options in (("--threads", 1), ("--threads", 3), ("--memory", "1MiB")):
            self.assertEqual(self.compare(out, scan, *options), found)
        self.assertEqual([p.name for p in self.folder.glob("*compare*")], [])

    def test_a_cube(self):
        cube = self.file("cube.obj", obj(CUBE, CUBE_QUADS))
        found = self.compare(cube, cube)
        r = found["remesh"]
        self.assertEqual((r["faces"], r["quads"], r["interior_vertices"], r["irregular_vertices"],
                          r["euler"]), (6, 6, 8, 8, 2))
        self.assertAlmostEqual(r["mean_scaled_jacobian"], 1)
        self.assertAlmostEqual(r["mean_corner_deviation"], 0)
        self.assertAlmostEqual(r["edge_length_variation"], 0)
        self.assertAlmostEqual(found["scan"]["area"], 6)
        self.assertAlmostEqual(found["scan"]["diagonal"], 3 ** 0.5)
        for way in found["distance"].values():
            self.assertLess(way["max"], 1e-6)

    def test_parallel_planes_anywhere(self):
        for offset in (0, 5.5e6):
            move = lambda mesh: obj([(x + offset, y + offset, z) for x, y, z in mesh[0]], mesh[1])
            low = self.file("low.obj", move(grid(4, 0.0)))
            high = self.file("high.obj", move(grid(3, 0.25)))
            found = self.compare(high, low)
            percent = 100 * 0.25 / 2 ** 0.5
            for way in found["distance"].values():
                for name in ("mean", "rms", "max"):
                    self.assertAlmostEqual(way[name], percent, places=4)
                self.assertAlmostEqual(way["p99"], percent, delta=percent / 1000)
            self.assertEqual(found["remesh"]["boundary_loops"], 1)
            self.assertEqual(found["remesh"]["interior_vertices"], 4)
            self.assertEqual(found["remesh"]["irregular_vertices"], 0)

    def test_defects_are_seen(self):
        vertices, quads = grid(2, 0.0)
        flat = self.file("flat.obj", obj(vertices, quads))
        for name, faces in (
            ("duplicate_faces", quads + [quads[0]]),
            ("non_manifold_edges", quads + [(1, 4, 6)]),
            ("repeated_vertices", quads + [(6, 7, 7, 8)]),
            ("inconsistent_edges", [quads[0][::-1]] + quads[1:]),
            ("other_degrees", [(0, 1, 2, 5, 4, 3)] + quads[2:]),
            ("unused_vertices", quads[1:]),
        ):
            with self.subTest(name=name):
                bad = self.file("bad.obj", obj(vertices, faces))
                self.assertGreater(self.compare(bad, flat)["remesh"]["defects"][name], 0)
        bent = list(vertices)
        bent[0] = (0.2, 0.2, 0)
        dented = self.file("dented.obj", obj(bent, quads))
        self.assertEqual(self.compare(dented, flat)["remesh"]["defects"]["inverted_quads"], 0)
        bent[0] = (0.3, 0.3, 0)
        dented = self.file("dented.obj", obj(bent, quads))
        self.assertEqual(self.compare(dented, flat)["remesh"]["defects"]["inverted_quads"], 1)

    def test_remeshes_and_scans_in_any_place(self):
        scan, a, b = (self.folder / n for n in ("scan.ply", "a.drc", "b.ply"))
        rattan("synth", "-o", scan, "--triangles", 8000, "--quiet")
        for out, faces in ((a, 500), (b, 300)):
            self.assertEqual(rattan("remesh", scan, "-o", out, "--faces", faces, "--quiet")
                             .returncode, 0)
        self.assertLess(self.compare(scan, scan)["distance"]["remesh_to_scan"]["max"], 1e-9)
        self.assertLess(self.compare(a, a)["distance"]["scan_to_remesh"]["max"], 1e-4)
        one, two = self.compare(a, b), self.compare(scan, a)
        self.assertEqual(one["scan"]["euler"], 2)
        self.assertEqual(two["remesh"]["quads"], 0)
        self.assertLess(0, one["distance"]["remesh_to_scan"]["mean"])

    def test_errors_are_sentences(self):
        cube = self.file("cube.obj", obj(CUBE, CUBE_QUADS))
        empty = self.file("empty.obj", "")
        nan = self.file("nan.obj", obj(CUBE, CUBE_QUADS).replace("v 1.0 1.0 1.0", "v nan 1 1"))
        text = self.file("text.drc", "not a mesh")
        for words, code in (
            (["compare"], 2),
            (["compare", cube], 2),
            (["compare", cube, cube, "--samples", "-3"], 2),
            (["compare", cube, cube, "--colour"], 2),
            (["compare", self.folder / "none.drc", cube], 3),
            (["compare", cube, self.folder / "none.obj"], 3),
            (["compare", empty, cube], 3),
            (["compare", cube, empty], 3),
            (["compare", nan, cube], 3),
            (["compare", text, cube], 3),
            (["compare", cube, text], 3),
            (["compare", self.folder, cube], 3),
            (["compare", cube, cube, "--json", self.folder / "no" / "such.json"], 4),
        ):
            with self.subTest(words=words):
                done = rattan(*words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn("rattan: ", done.stderr)
                self.assertNotIn("terminate", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
