# SPDX-License-Identifier: MIT
"""What users count on around `rattan layout`: the memory budget, --dry-run, the JSON log, what is
refused before any work, files of the input that stay, and scans that are hard to chart."""

import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

import layout_checks
import mesh_checks
import odd_meshes

RATTAN = os.environ["RATTAN"]
MIB = 1 << 20
STAGES = ["ingest", "field", "parameterize", "charts", "flatten", "write"]


def run(*words):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=300)


def peak_of(*words):
    """Exit code, peak resident set in bytes, stderr; from a process that is small itself, as what
    forks counts for what it starts."""
    script = ("import resource, subprocess, sys\n"
              "code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode\n"
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)\n"
              "sys.exit(code)\n")
    done = subprocess.run([sys.executable, "-c", script, RATTAN, *map(str, words)],
                          capture_output=True, text=True, timeout=300)
    return done.returncode, int(done.stdout.split()[-1]), done.stderr


def hills(nu, nv=None, size=10.0):
    """A sheet of relief, and a colour at each vertex."""
    nv = nv or nu
    mesh = odd_meshes.sheet(nu, lambda u, v: (size * u, size * v, 0.4 * math.sin(9 * u) * math.cos(7 * v)))
    colours = [(int(255 * p[0] / size), int(255 * p[1] / size), 90) for p in mesh[0]]
    return mesh, colours


def perforated(n=60):
    """A sheet where every second cell of every second row is missing."""
    vertices, triangles = odd_meshes.sheet(n, lambda u, v: (n * u, n * v, math.sin(3 * u)))
    kept = [t for i, t in enumerate(triangles)
            if (i // 2) // n % 3 != 1 or (i // 2) % n % 3 != 1]
    return vertices, kept


def write_obj(path, mesh, head=(), uv=False):
    vertices, triangles = mesh
    lines = list(head) + ["v " + " ".join(repr(float(x)) for x in p) for p in vertices]
    if uv:
        lines += [f"vt {p[0] / 10!r} {p[1] / 10!r}" for p in vertices] + ["usemtl paint"]
    corner = (lambda i: f"{i + 1}/{i + 1}") if uv else (lambda i: f"{i + 1}")
    lines += ["f " + " ".join(map(corner, t)) for t in triangles]
    path.write_text("\n".join(lines) + "\n")


def write_png(path, side=8):
    rows = b"".join(b"\0" + bytes(c for x in range(side) for c in (30 * x, 30 * y, 99))
                    for y in range(side))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class LayoutGuards(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def synth(self, triangles, genus=1, holes=1):
        scan = self.folder / f"scan{triangles}.ply"
        made = run("synth", "-o", scan, "--triangles", triangles, "--genus", genus, "--holes", holes,
                   "--quiet")
        self.assertEqual(made.returncode, 0, made.stderr)
        return scan

    def coloured(self, n):
        scan = self.folder / f"coloured{n}.ply"
        mesh, colours = hills(n)
        odd_meshes.write_ply(scan, mesh, colours)
        return scan

    def within(self, mib, *words):
        code, peak, errors = peak_of("layout", *words, "--quiet", "--memory", f"{mib}MiB")
        self.assertEqual(code, 0, errors)
        self.assertLessEqual(peak, mib * MIB, f"{peak / MIB:.0f} of {mib} MiB")

    def files(self):
        return {p.name: p.read_bytes() for p in self.folder.iterdir() if p.is_file()}

    # Memory

    def test_the_budget_holds(self):
        scan = self.synth(400000)
        self.within(1024, scan, "-o", self.folder / "whole.ply")
        for extension in (".ply", ".obj"):
            self.within(96, scan, "-o", self.folder / f"small{extension}")
        self.assertEqual((self.folder / "small.ply").read_bytes(),
                         (self.folder / "whole.ply").read_bytes())
        self.assertEqual(list(self.folder.glob("*.work")), [])

    def test_the_budget_holds_with_an_image(self):
        self.within(160, self.coloured(150), "-o", self.folder / "baked.obj", "--bake", 2048)

    def test_too_small_a_budget_is_refused_with_the_one_that_will_do(self):
        scan = self.synth(200000)
        for extension, words in ((".ply", ("--chart-size", "2")), (".drc", ())):
            with self.subTest(extension=extension):
                out = self.folder / f"refused{extension}"
                code, peak, errors = peak_of("layout", scan, "-o", out, "--memory", "80MiB",
                                             "--quiet", *words)
                for _ in range(4):  # what is known later may add to what was known before
                    self.assertEqual(code, 4, errors)
                    self.assertEqual(len(errors.strip().splitlines()), 1, errors)
                    self.assertFalse(out.exists())
                    enough = int(re.search(r"(?:--memory|at least) (\d+) ?MiB\W*$|--memory (\d+)MiB", errors)
                                 .expand(r"\1\2"))
                    code, peak, errors = peak_of("layout", scan, "-o", out, "--quiet", *words,
                                                 "--memory", f"{enough}MiB")
                    if code == 0:
                        break
                self.assertEqual(code, 0, errors)
                self.assertLessEqual(peak, enough * MIB)

    def test_a_dry_run_tells_and_leaves_nothing(self):
        scan = self.synth(20000)
        before = self.files()
        out = self.folder / "dry.drc"
        done = run("layout", scan, "-o", out, "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        for word in "scan", "layout", "tiles", "memory", "disk", "passes", "time":
            self.assertRegex(done.stdout, rf"(?m)^{word} ")
        done = run("layout", scan, "-o", out, "--dry-run", "--memory", "40MiB")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("TOO LITTLE", done.stdout)
        for name in ("out.off", "none/out.obj", scan.name):
            done = run("layout", scan, "-o", self.folder / name, "--dry-run")
            self.assertIn(done.returncode, (2, 3), name)
        self.assertEqual(self.files(), before)

    # The JSON log

    def events(self, *words, code=0):
        done = subprocess.run([RATTAN, "layout", "--log-format", "json", *map(str, words)],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        events = [json.loads(line) for line in done.stderr.splitlines()]
        self.assertEqual([e["exit"] for e in events if e["event"] == "end"], [code])
        self.assertEqual(events[-1]["event"], "end")
        self.assertEqual([e["exit"] for e in events if e["event"] == "error"], [code] if code else [])
        return [e for e in events if e["event"] != "progress"]

    def test_events(self):
        scan = self.coloured(40)
        report = self.folder / "report.json"
        out = self.folder / "out.obj"
        events = self.events(scan, "-o", out, "--bake", 64, "--report", report)
        self.assertEqual(events[0]["event"], "start")
        self.assertEqual(events[0]["output"], str(out))
        self.assertTrue(all(e["scan"] == str(scan) for e in events))
        stages = [e["name"] for e in events if e["event"] == "stage"]
        self.assertEqual(list(dict.fromkeys(stages)), [*STAGES, "bake"])
        told = json.loads(report.read_text())
        output, = [e for e in events if e["event"] == "output"]
        self.assertEqual(output["charts"], told["charts"]["count"])
        self.assertEqual(output["triangles"], told["output"]["triangles"])
        self.assertEqual(output["bytes"], out.stat().st_size)
        self.assertEqual(output["files"], [str(self.folder / name) for name in (
            "out.obj", "out.base.obj", "out.charts.json", "out.png", "out.mtl", "report.json")])
        for file in output["files"]:
            self.assertGreater(Path(file).stat().st_size, 0, file)
        plan = self.events(scan, "-o", out, "--dry-run")[0]
        self.assertEqual(plan["event"], "plan")
        self.assertTrue(plan["fits"] and plan["charts"] > 0)

    def test_events_of_failures(self):
        scan = self.coloured(10)
        self.events(scan, "-o", self.folder / "out.off", code=2)
        self.events(scan, "-o", self.folder / "none" / "out.obj", code=3)
        self.events(self.folder / "none.ply", "-o", self.folder / "out.obj", code=3)
        self.events(scan, "-o", self.folder / "out.obj", "--memory", "41MiB", code=4)

    # Refusals

    def refused(self, code, word, *words):
        before = self.files()
        done = run("layout", *words, "--quiet")
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertIn(word, done.stderr)
        self.assertEqual(self.files(), before)

    def test_the_input_is_never_replaced(self):
        mesh, _ = hills(24)
        scan = self.folder / "bust.obj"
        write_obj(scan, mesh, ("mtllib paint.mtl",), uv=True)
        (self.folder / "paint.mtl").write_text("newmtl paint\nmap_Kd skin.png\n")
        write_png(self.folder / "skin.png")
        (self.folder / "link.obj").symlink_to(scan)
        self.refused(2, "replace the scan", scan, "-o", scan)
        self.refused(2, "replace the scan", scan, "-o", self.folder / "link.obj")
        self.refused(2, "replace the scan", scan, "-o", self.folder / "out.obj", "--report", scan)
        shutil.copy(scan, self.folder / "of.base.obj")
        self.refused(2, "replace the scan", self.folder / "of.base.obj", "-o", self.folder / "of.obj")
        for name in ("paint.obj", "skin.ply", "skin.drc", "skin.obj"):
            self.refused(2, "that the scan needs", scan, "-o", self.folder / name, "--bake", 64)
        self.refused(2, "two files", scan, "-o", self.folder / "out.ply", "--bake", 64, "--preview",
                     self.folder / "out.png")
        done = run("layout", scan, "-o", self.folder / "out.obj", "--bake", 64, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_what_cannot_be_done_is_refused_before_any_work(self):
        scan = self.folder / "plain.ply"
        odd_meshes.write_ply(scan, hills(24)[0])
        self.refused(2, "no colours", scan, "-o", self.folder / "out.obj", "--bake", 64)
        points = self.folder / "points.ply"
        odd_meshes.write_ply(points, (hills(3)[0][0], []))
        self.refused(3, "points.ply", points, "-o", self.folder / "out.obj")
        self.refused(3, "none", scan, "-o", self.folder / "none" / "out.obj")
        self.refused(2, "out.off", scan, "-o", self.folder / "out.off")
        self.refused(4, "memory", self.coloured(30), "-o", self.folder / "out.obj", "--bake", 32768,
                     "--memory", "256MiB")

    def test_info(self):
        scan = self.synth(8000)
        out = self.folder / "out.drc"
        self.assertEqual(run("layout", scan, "-o", out, "--quiet", "--keep-work").returncode, 0)
        done = run("info", self.folder / "out.drc.work")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("layout/flat", done.stdout)
        for name in ("out.drc", "out.base.drc"):
            done = run("info", self.folder / name)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, r"(?m)^Euler characteristic -1$")

    # Hard scans

    def check(self, scan, *words):
        out = self.folder / "out.obj"
        report = self.folder / "report.json"
        done = run("layout", scan, "-o", out, "--quiet", "--report", report, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(report.read_text())
        surface = tuple(told["input"][k] for k in ("components", "boundary_loops", "euler"))
        self.assertEqual(layout_checks.layout_problems(out, told["output"]["charts"], *surface), [])
        vertices, faces = mesh_checks.read_mesh(told["base_complex"]["path"])
        self.assertEqual(layout_checks.base_complex_problems(faces, len(vertices), *surface), [])
        return told

    def test_holes_everywhere(self):
        mesh = perforated()
        scan = self.folder / "holes.ply"
        odd_meshes.write_ply(scan, mesh)
        told = self.check(scan)
        self.assertEqual(told["input"]["boundary_loops"], mesh_checks.topology(mesh[1]).loops)
        self.assertGreater(told["input"]["boundary_loops"], 300)

    def test_charts_larger_than_the_scan(self):
        for name, mesh in (("sphere", odd_meshes.sphere()), ("torus", odd_meshes.torus()),
                           ("sheet", odd_meshes.sheet())):
            with self.subTest(scan=name):
                scan = self.folder / f"{name}.ply"
                odd_meshes.write_ply(scan, mesh)
                self.check(scan, "--chart-size", 100)

    def test_duplicate_triangles(self):
        vertices, triangles = odd_meshes.torus()
        scan = self.folder / "twice.ply"
        odd_meshes.write_ply(scan, (vertices, triangles + triangles[::5]))
        told = self.check(scan)
        self.assertEqual((told["input"]["components"], told["input"]["euler"]), (1, 0))

    def test_map_coordinates_come_back_exactly(self):
        (vertices, triangles), _ = hills(40, size=640)
        moved = [(4.5e6 + round(64 * x) / 64, 6.1e5 + round(64 * y) / 64, 120 + round(64 * z) / 64)
                 for x, y, z in vertices]
        scan = self.folder / "map.obj"
        write_obj(scan, (moved, triangles))
        self.check(scan)
        written = layout_checks.read_layout(self.folder / "out.obj").positions
        self.assertLessEqual(set(moved), {tuple(p) for p in written})


if __name__ == "__main__":
    unittest.main(verbosity=2)
