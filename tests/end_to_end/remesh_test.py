# SPDX-License-Identifier: MIT
"""The main job as a user types it, checked from outside: topology, polygons through the stock
draco_decoder, same bytes for any thread count, exit codes."""

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import mesh_checks

RATTAN = os.environ["RATTAN"]
DATA = os.environ.get("RATTAN_DATA")
SAMPLES = ["nefertiti.obj", "koala.obj", "gargoyle.obj", "rocker-arm.obj", "fandisk.obj",
           "fertility.off", "bun_zipper.ply", "plane_holes.obj"]
MANY_QUADS = {"nefertiti.obj", "koala.obj", "bun_zipper.ply"}


def rattan(*words):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=120)


class Remesh(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def remesh(self, scan, *options, output="out.drc", keep_name=True):
        report = self.folder / "report.json"
        done = rattan("remesh", scan, "-o", self.folder / output, "--quiet", "--report", report,
                      *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / output).exists(), keep_name)
        self.assertEqual(list(self.folder.glob("*.work")), [])
        return json.loads(report.read_text())

    def decode(self, output="out.drc"):
        decoded = self.folder / "decoded.obj"
        subprocess.run(["draco_decoder", "-i", self.folder / output, "-o", decoded], check=True,
                       capture_output=True)
        return mesh_checks.read_obj(decoded)

    def check(self, scan, *options, quads=None):
        before = mesh_checks.topology(mesh_checks.read_mesh(scan)[1])
        report = self.remesh(scan, *options)
        vertices, faces = self.decode()
        self.assertEqual(mesh_checks.violations(faces, len(vertices)), {})
        after = mesh_checks.topology(faces)
        for name in ("components", "loops", "euler"):
            self.assertEqual(getattr(after, name), getattr(before, name), name)
        self.assertEqual(report["output"]["faces"], len(faces))
        self.assertEqual(report["output"]["quads"], sum(len(f) == 4 for f in faces))
        self.assertEqual(report["input"]["euler"], before.euler)
        self.assertEqual(report["input"]["components"], before.components)
        self.assertEqual(report["input"]["boundary_loops"], before.loops)
        if quads is not None:
            self.assertGreaterEqual(report["output"]["quads"], quads * len(faces))
            self.assertTrue(report["output"]["target_met"])
        return report

    @unittest.skipUnless(DATA, "RATTAN_DATA is not set")
    def test_sample_scans(self):
        for name in SAMPLES:
            for options in (("--ratio", "0.05"), ("--faces", "200")):
                with self.subTest(scan=name, options=options):
                    quads = 0.96 if name in MANY_QUADS and options[0] == "--ratio" else None
                    self.check(Path(DATA) / name, *options, quads=quads)

    def test_synthesised_scans(self):
        for genus in (0, 1, 20):
            for holes in (0, 3):
                scan = self.folder / f"synth_{genus}_{holes}.ply"
                made = rattan("synth", "-o", scan, "--triangles", 40000, "--genus", genus,
                              "--holes", holes, "--quiet")
                self.assertEqual(made.returncode, 0, made.stderr)
                for options in (("--ratio", "0.05"), ("--faces", "200")):
                    with self.subTest(genus=genus, holes=holes, options=options):
                        self.check(scan, *options)

    def check_pure(self, scan, *options):
        report = self.check(scan, "--pure-quads", *options)
        self.assertEqual(report["output"]["triangles"], 0)
        self.assertEqual(report["output"]["quads"], report["output"]["faces"])
        self.assertEqual(report["output"]["bad_quads"], 0)
        self.assertFalse(any("folded" in w for w in report["warnings"]))
        # Rounding positions for the file folds none either.
        figures = self.folder / "figures.json"
        done = rattan("compare", self.folder / "out.drc", scan, "--quiet", "--json", figures)
        self.assertEqual(done.returncode, 0, done.stderr)
        remesh = json.loads(figures.read_text())["remesh"]
        self.assertEqual(remesh["defects"]["inverted_quads"], 0)

    def test_pure_quads(self):
        for genus, holes in ((0, 0), (2, 0), (1, 3), (20, 3)):
            scan = self.folder / f"synth_{genus}_{holes}.ply"
            rattan("synth", "-o", scan, "--triangles", 40000, "--genus", genus, "--holes", holes,
                   "--quiet")
            for options in (("--ratio", "0.02"), ("--ratio", "0.05")):
                with self.subTest(genus=genus, holes=holes, options=options):
                    self.check_pure(scan, *options)

    @unittest.skipUnless(DATA, "RATTAN_DATA is not set")
    def test_pure_quads_of_sample_scans(self):
        for name in SAMPLES:
            with self.subTest(scan=name):
                self.check_pure(Path(DATA) / name, "--ratio", "0.05")

    def test_several_sizes(self):
        scan = self.folder / "synth.ply"
        rattan("synth", "-o", scan, "--triangles", 40000, "--holes", 1, "--quiet")
        before = mesh_checks.topology(mesh_checks.read_mesh(scan)[1])
        asked = {"4k": 4000, "600": 600, "1k": 1000}
        report = self.remesh(scan, "--faces", ",".join(asked), output="out.obj", keep_name=False)
        outputs = report["outputs"]
        self.assertEqual(report["output"], {k: v for k, v in outputs[0].items()
                                            if k in report["output"]})
        self.assertEqual([o["target_faces"] for o in outputs], list(asked.values()))
        for output, faces in zip(outputs, asked.values()):
            path = self.folder / f"out-{faces}.obj"
            self.assertEqual(output["path"], str(path))
            vertices, polygons = mesh_checks.read_mesh(path)
            self.assertEqual(mesh_checks.violations(polygons, len(vertices)), {})
            after = mesh_checks.topology(polygons)
            self.assertEqual((after.components, after.loops, after.euler),
                             (before.components, before.loops, before.euler))
            self.assertEqual(output["faces"], len(polygons))
            self.assertLessEqual(abs(len(polygons) - faces), 0.15 * faces)
        # 4000 faces take twice the lines of the parameterization for 1000; what has a
        # parameterization of its own has the bytes of a run with that size alone.
        self.assertEqual([o["shared_with"] for o in outputs], [outputs[2]["path"], None, None])
        for faces in (600, 1000):
            self.remesh(scan, "--faces", faces, output="alone.obj")
            self.assertEqual((self.folder / "alone.obj").read_bytes(),
                             (self.folder / f"out-{faces}.obj").read_bytes())
        first = (self.folder / "out-4000.obj").read_bytes()
        self.remesh(scan, "--faces", "1k,4k", "--threads", 1, output="{n}.obj", keep_name=False)
        self.assertEqual((self.folder / "2.obj").read_bytes(), first)
        # Names are refused before anything is read or written.
        for words in (["--faces", "10,20,10"], ["--ratio", "0.1,0.2", "-o", "{faces}.obj"]):
            with self.subTest(words=words):
                out = ["-o", self.folder / "no.obj"] if "-o" not in words else []
                done = rattan("remesh", self.folder / "none.ply", *words, *out)
                self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(list(self.folder.glob("no*.obj")), [])

    def test_field_of_the_user(self):
        """A plane with a field at 17 degrees, in a scan whose vertices come in another order than
        along the curve: the inner edges of the remesh lie along it or across."""
        n, turn = 60, math.radians(17)
        order = [(i * 1709) % ((n + 1) * (n + 1)) for i in range((n + 1) * (n + 1))]
        place = {grid: k for k, grid in enumerate(order)}
        scan, field = self.folder / "plane.obj", self.folder / "field.txt"
        with open(scan, "w") as f:
            for g in order:
                f.write(f"v {g % (n + 1)} {g // (n + 1)} 0\n")
            for y in range(n):
                for x in range(n):
                    a, b, c, d = (1 + place[(y + v) * (n + 1) + x + u]
                                  for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)))
                    f.write(f"f {a} {b} {c}\nf {a} {c} {d}\n")
        lines = [f"{3 * math.cos(turn)} {3 * math.sin(turn)} 0"
                 for g in order]
        field.write_text("# 17 degrees\n" + "\n".join(lines) + "\n")
        self.remesh(scan, "--field", field, "--faces", 400, output="out.obj")
        vertices, faces = mesh_checks.read_mesh(self.folder / "out.obj")
        off = []
        for face in faces:
            for a, b in zip(face, face[1:] + face[:1]):
                p, q = vertices[a], vertices[b]
                if all(9 < c < n - 9 for c in (*p[:2], *q[:2])):
                    angle = math.degrees(math.atan2(q[1] - p[1], q[0] - p[0])) - 17
                    off.append(abs((angle + 45) % 90 - 45))
        self.assertGreater(len(off), 200)
        self.assertLess(sorted(off)[len(off) // 2], 1.0)
        for text, said in (("\n".join(lines[1:]), "3720 vectors"), ("1 0 nan\n", "line 1"),
                           ("\n".join([*lines, "1 0 0"]), "3722 vectors")):
            field.write_text(text)
            done = rattan("remesh", scan, "-o", self.folder / "x.drc", "--field", field)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn("field.txt", done.stderr)
            self.assertIn(said, done.stderr)
            self.assertFalse((self.folder / "x.drc").exists())

    def test_same_bytes_for_any_thread_count(self):
        scan = self.folder / "synth.ply"
        rattan("synth", "-o", scan, "--triangles", 60000, "--quiet")
        outputs = []
        for threads in (1, 2, 3):
            self.remesh(scan, "--threads", threads, output=f"{threads}.drc")
            outputs.append((self.folder / f"{threads}.drc").read_bytes())
        self.assertEqual(outputs[0], outputs[1])
        self.assertEqual(outputs[0], outputs[2])

    def test_every_format_holds_the_same_mesh(self):
        scan = self.folder / "synth.ply"
        rattan("synth", "-o", scan, "--triangles", 8000, "--holes", 1, "--quiet")
        meshes = []
        for extension in ("obj", "ply", "off"):
            self.remesh(scan, output="out." + extension)
            meshes.append(mesh_checks.read_mesh(self.folder / ("out." + extension)))
        for vertices, faces in meshes[1:]:
            self.assertEqual([tuple(f) for f in faces], [tuple(f) for f in meshes[0][1]])
            self.assertEqual(vertices, meshes[0][0])

    def test_errors_are_sentences(self):
        broken = self.folder / "broken.ply"
        broken.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
                           b"property float x\nproperty float y\nproperty float z\n"
                           b"element face 1\nproperty list uchar int vertex_indices\nend_header\n\0")
        stl = self.folder / "scan.stl"
        stl.write_text("solid x\nendsolid x\n")
        good = self.folder / "good.ply"
        rattan("synth", "-o", good, "--triangles", 2000, "--quiet")
        out = self.folder / "out.drc"
        for words, code in (
            (["remesh", self.folder / "none.ply", "-o", out], 3),
            (["remesh", broken, "-o", out], 3),
            (["remesh", stl, "-o", out], 3),
            (["remesh", good], 2),
            (["remesh", good, "-o", self.folder / "out.xyz"], 2),
            (["remesh", good, "-o", out, "--faces", "many"], 2),
            (["remesh", good, "-o", out, "--faces", "0"], 2),
            (["remesh", good, "-o", out, "--faces", "10,,20"], 2),
            (["remesh", good, "-o", out, "--faces", "10", "--ratio", "0.1"], 2),
            (["remesh", good, "-o", out, "--smoothing", "1.5"], 2),
            (["remesh", good, "-o", out, "--colour"], 2),
            (["remesh", good, "-o", self.folder / "no" / "such" / "out.drc"], 2),
            (["nonsense"], 2),
            ([], 2),
        ):
            with self.subTest(words=words):
                done = rattan(*words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn("rattan: ", done.stderr)
                self.assertNotIn("terminate", done.stderr)
                self.assertFalse(out.exists())


if __name__ == "__main__":
    if not DATA:
        print("RATTAN_DATA is not set: the tests on sample scans are skipped", file=sys.stderr)
    unittest.main(verbosity=2)
