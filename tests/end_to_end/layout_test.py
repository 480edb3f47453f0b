# SPDX-License-Identifier: MIT
"""Layouts as a user asks for them, checked from outside (layout_checks.py): the surface, charts and
parts as disks, no folded triangle, coordinates that continue point by point, the base complex."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import layout_checks
import mesh_checks
import odd_meshes

RATTAN = os.environ["RATTAN"]
DATA = os.environ.get("RATTAN_DATA")
SAMPLES = ["3holes.off", "bun_zipper.ply", "bunny25k.obj", "demosthenes-low-res.obj", "fandisk.obj",
           "fertility.off", "gargoyle.obj", "koala.obj", "nefertiti.obj", "plane_holes.obj",
           "rocker-arm.obj", "spot.obj"]
# Checking a hundred thousand triangles in Python takes its time: the larger ones on request.
LARGE = ["bun_zipper.ply", "gargoyle.obj", "koala.obj", "nefertiti.obj"]
ALL = os.environ.get("RATTAN_ALL_SCANS") == "1"
# Read in every format, with and without curl correction: the small ones.
SMALL = ["3holes.off", "fertility.off", "plane_holes.obj", "spot.obj"]
REFUSED = {"repeated_indices_only"}


def rattan(*words):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=300)


class LayoutFiles(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def layout(self, scan, *options, output="out.obj"):
        report = self.folder / "report.json"
        done = rattan("layout", scan, "-o", self.folder / output, "--quiet", "--report", report,
                      *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(list(self.folder.glob("*.work")), [])
        return json.loads(report.read_text())

    def problems(self, report, output, folder=None):
        """Of the files that a report is about, with the topology that it says of its scan."""
        said = report["input"]
        surface = (said["components"], said["boundary_loops"], said["euler"])
        found = layout_checks.layout_problems(
            output, report["output"]["charts"], *surface, folder or self.folder,
            report["output"]["texture_step"])
        base = Path(report["base_complex"]["path"])
        if base.suffix == ".drc":
            decoded = base.with_suffix(".obj")
            subprocess.run(["draco_decoder", "-i", base, "-o", decoded], check=True,
                           capture_output=True)
            base = decoded
        vertices, faces = mesh_checks.read_mesh(base)
        found += layout_checks.base_complex_problems(faces, len(vertices), *surface)
        if report["base_complex"]["quads"] != len(faces):
            found.append(f"{len(faces)} quads, not {report['base_complex']['quads']}")
        return found

    def check(self, scan, *options, output="out.obj"):
        before = mesh_checks.topology(mesh_checks.read_mesh(scan)[1])
        report = self.layout(scan, *options, output=output)
        said = report["input"]
        self.assertEqual((said["components"], said["boundary_loops"], said["euler"]),
                         (before.components, before.loops, before.euler))
        self.assertEqual(self.problems(report, self.folder / output), [])
        return report

    @unittest.skipUnless(DATA, "RATTAN_DATA is not set")
    def test_sample_scans(self):
        for name in [n for n in SAMPLES if ALL or n not in LARGE]:
            with self.subTest(scan=name):
                self.check(Path(DATA) / name)

    @unittest.skipUnless(DATA, "RATTAN_DATA is not set")
    def test_every_format_of_sample_scans(self):
        for name in SMALL:
            for extension, options in ((".ply", ()), (".drc", ("--curl-correction",))):
                with self.subTest(scan=name, extension=extension, options=options):
                    self.check(Path(DATA) / name, *options, output="out" + extension)

    def synthesise(self, triangles, genus=0, holes=0):
        scan = self.folder / f"synth_{genus}_{holes}.ply"
        made = rattan("synth", "-o", scan, "--triangles", triangles, "--genus", genus, "--holes",
                      holes, "--quiet")
        self.assertEqual(made.returncode, 0, made.stderr)
        return scan

    def test_synthesised_scans(self):
        for genus in (0, 1, 20):
            for holes in (0, 3):
                scan = self.synthesise(10000, genus, holes)
                output = "out.drc" if holes > 0 else "out.obj"
                with self.subTest(genus=genus, holes=holes):
                    self.check(scan, output=output)

    def test_chart_sizes(self):
        scan = self.synthesise(10000, 1, 1)
        default = self.check(scan)
        side = default["charts"]["side"]
        for factor in (0.4, 3.0, 30.0):
            with self.subTest(factor=factor):
                report = self.check(scan, "--chart-size", side * factor)
                self.assertLessEqual(report["charts"]["side"], side * factor * (1 + 1e-9))

    def test_other_commands_read_layouts(self):
        scan = self.synthesise(10000, 1)
        said = self.layout(scan)["output"]
        for extension in (".obj", ".ply", ".drc"):
            with self.subTest(extension=extension):
                output = "out" + extension
                self.layout(scan, output=output)
                layout = self.folder / output
                info = rattan("info", layout)
                self.assertEqual(info.returncode, 0, info.stderr)
                figures = self.folder / "figures.json"
                done = rattan("compare", layout, scan, "--quiet", "--json", figures)
                self.assertEqual(done.returncode, 0, done.stderr)
                compared = json.loads(figures.read_text())
                for way in compared["distance"].values():
                    self.assertLess(way["max"], 2e-5 * compared["scan"]["diagonal"])
                report = self.folder / "remesh.json"
                done = rattan("remesh", layout, "-o", self.folder / "remesh.ply", "--faces", 500,
                              "--quiet", "--report", report)
                self.assertEqual(done.returncode, 0, done.stderr)
                read = json.loads(report.read_text())["input"]
                self.assertEqual(read["vertices"], said["vertices"])
                self.assertEqual(read["triangles"], said["triangles"])
                self.assertEqual((read["components"], read["boundary_loops"], read["euler"]),
                                 (1, 0, 0))

    def test_the_same_bytes_whatever_the_threads(self):
        scan = self.synthesise(20000, 2, 1)
        for extension in (".obj", ".ply", ".drc"):
            with self.subTest(extension=extension):
                written = []
                for threads in (1, 3):
                    report = self.layout(scan, "--threads", threads, output="out" + extension)
                    written.append([Path(p).read_bytes() for p in
                                    (report["output"]["path"], report["output"]["charts"],
                                     report["base_complex"]["path"])])
                self.assertEqual(written[0], written[1])

    def test_what_cannot_be_written_is_refused_at_once(self):
        scan = self.synthesise(2000)
        for output, code in (("out.off", 2), ("out", 2), ("none/out.obj", 3)):
            done = rattan("layout", scan, "-o", self.folder / output, "--quiet")
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        # A Draco file is encoded in memory.
        large = self.synthesise(400000, 1)
        done = rattan("layout", large, "-o", self.folder / "out.drc", "--quiet", "--memory", "100MiB")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("memory", done.stderr)

    def odd_problem(self, name, scan):
        """What is wrong with one run, None if nothing is."""
        folder = self.folder / name
        folder.mkdir()
        try:
            done = rattan("layout", scan, "-o", folder / "out.obj", "--quiet", "--threads", "1",
                          "--report", folder / "report.json")
        except subprocess.TimeoutExpired:
            return "takes too long"
        if done.returncode == 3:
            sentence = done.stderr.strip().splitlines()
            if (folder / "out.obj").exists() or len(sentence) != 1:
                return f"exit 3: {done.stderr[-300:]}"
            return None if name in REFUSED else f"refused: {sentence[0]}"
        if done.returncode != 0:
            return f"exit {done.returncode}: {done.stderr[-300:]}"
        report = json.loads((folder / "report.json").read_text())
        return "; ".join(self.problems(report, folder / "out.obj", folder)) or None

    def test_odd_meshes(self):
        scans = {}
        meshes = odd_meshes.all_meshes()
        meshes["tiny_components"] = odd_meshes.tiny_components(300)
        for name, mesh in meshes.items():
            scans[name] = self.folder / f"{name}.ply"
            odd_meshes.write_ply(scans[name], mesh)
        with ThreadPoolExecutor(2) as pool:
            found = pool.map(lambda item: (item[0], self.odd_problem(*item)), scans.items())
        self.assertEqual({name: problem for name, problem in found if problem}, {})


if __name__ == "__main__":
    unittest.main()
