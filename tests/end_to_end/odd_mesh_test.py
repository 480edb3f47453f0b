# SPDX-License-Identifier: MIT
"""Odd scans through the whole pipeline: each gives a remesh with the repaired scan's topology, or is
refused with one sentence."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mesh_checks
import odd_meshes

RATTAN = os.environ["RATTAN"]
REFUSED = {"repeated_indices_only"}
SIZES = (("--ratio", "0.05"), ("--faces", "200"))
# Far more faces than triangles.
FINE = {"one_triangle": "3000", "two_apart": "3000", "one_needle": "3000", "cube": "5000",
        "tetrahedron": "3000", "pillow": "3000", "moebius": "3000", "klein_bottle": "3000",
        "annulus": "3000", "book": "3000", "zero_area_patch": "3000", "two_triangles": "100000"}


class OddMeshes(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def problem(self, name, scan, options):
        """What is wrong with one run, None if nothing is."""
        out = self.folder / f"{name}{''.join(options)}.ply"
        report = self.folder / f"{name}{''.join(options)}.json"
        try:
            done = subprocess.run(
                [RATTAN, "remesh", scan, "-o", out, "--quiet", "--threads", "1", "--report", report,
                 *options], capture_output=True, text=True, timeout=300)
        except subprocess.TimeoutExpired:
            return "takes too long"
        if name in REFUSED or done.returncode == 3:
            sentence = done.stderr.strip().splitlines()
            if done.returncode != 3 or out.exists() or len(sentence) != 1:
                return f"exit {done.returncode}: {done.stderr[-300:]}"
            return None if name in REFUSED else f"refused: {sentence[0]}"
        if done.returncode != 0:
            return f"exit {done.returncode}: {done.stderr[-300:]}"
        said = json.loads(report.read_text())["input"]
        vertices, faces = mesh_checks.read_mesh(out)
        violations = mesh_checks.violations(faces, len(vertices))
        if violations:
            return str(violations)
        after = mesh_checks.topology(faces)
        if (after.components, after.loops, after.euler) != (
                said["components"], said["boundary_loops"], said["euler"]):
            return f"{after} for {said}"
        return None

    def test_each_size(self):
        scans = {}
        for name, mesh in odd_meshes.all_meshes().items():
            scans[name] = self.folder / (name + ".ply")
            odd_meshes.write_ply(scans[name], mesh)
        runs = [(name, options) for name in scans for options in SIZES]
        runs += [(name, ("--faces", faces)) for name, faces in FINE.items()]
        runs.remove(("tiny_components", SIZES[1]))  # forty times that many are the least
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            problems = list(pool.map(lambda r: self.problem(r[0], scans[r[0]], r[1]), runs))
        for (name, options), problem in zip(runs, problems):
            with self.subTest(scan=name, options=options):
                self.assertIsNone(problem)

    def test_repairs_are_those_expected(self):
        for name, expected, topology in (
            ("one_triangle", {}, (1, 1, 1)),
            ("tiny_components", {}, (10000, 0, 20000)),
            ("nan", {"non_finite_vertices": 2, "non_finite_triangles": 12}, (1, 2, 0)),
            ("pinched", {"split_vertices": 1, "isolated_vertices": 1}, (2, 0, 4)),
            ("moebius", {"one_sided_components": 1, "non_manifold_edges": 4, "split_vertices": 5},
             (1, 1, 1)),
            ("book", {"non_manifold_edges": 1, "split_vertices": 8}, (5, 5, 5)),
            ("pillow", {"duplicate_triangles": 1}, (1, 1, 1)),
            ("coincident", {}, (2, 2, 2)),
            ("soup", {"triangle_soup": 1, "merged_vertices": 1440}, (1, 0, 0)),
        ):
            with self.subTest(scan=name):
                scan = self.folder / (name + ".ply")
                odd_meshes.write_ply(scan, odd_meshes.all_meshes()[name])
                report = self.folder / "report.json"
                done = subprocess.run([RATTAN, "remesh", scan, "-o", self.folder / "out.drc",
                                       "--report", report, "--quiet"], capture_output=True,
                                      text=True, timeout=300)
                self.assertEqual(done.returncode, 0, done.stderr)
                said = json.loads(report.read_text())
                counts = {k: n for k, n in said["input"]["repaired"].items() if n}
                self.assertEqual(counts, expected)
                self.assertEqual((said["output"]["components"], said["output"]["boundary_loops"],
                                  said["output"]["euler"]), topology)
                self.assertEqual("Moebius" in str(said["warnings"]), name == "moebius")
                self.assertEqual("finite" in str(said["warnings"]), name == "nan")


if __name__ == "__main__":
    unittest.main(verbosity=2)
