# SPDX-License-Identifier: MIT
"""Broken and odd files through `rattan remesh`: each gives a correct remesh or exit code 3 and one
sentence that names the file and the place. Never a crash, a hang, much memory or a partial output.
"""

import gzip
import os
import random
import re
import resource
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mesh_checks
from scan_samples import (ascii_ply, ascii_stl, binary_ply, binary_stl, draco_header, grid, joined,
                          moebius, moved, obj, off, quad_torus, soup, sphere, tetrahedron, torus,
                          zstd_frame)

RATTAN = os.environ["RATTAN"]
NAN, INF = float("nan"), float("inf")
PLACE = re.compile(r": (line|byte|triangle) \d+")
MOST_RSS = 500 << 20
CPU_SECONDS = 40  # a hang is told by processor time, so that a busy machine makes no difference


def noise(n, seed):
    return random.Random(seed).randbytes(n)


def with_vertex(mesh, number, position):
    vertices = list(mesh[0])
    vertices[number] = position
    return vertices, mesh[1]


def refused_files():
    """(name, bytes, whether the sentence must name a place in the file)"""
    t = torus(8, 5)
    tri = ([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [(0, 1, 2)])
    text_obj, text_ply, text_off = obj(t), ascii_ply(t), off(t)
    text_stl, little, bin_stl = ascii_stl(t), binary_ply(t), binary_stl(t)
    for name in ("empty.ply", "empty.obj", "empty.stl", "empty.off", "empty.drc", "empty"):
        yield name, b"", False
    yield "blank.obj", b" \n\t\n\n", False
    yield "prose.obj", b"Once upon a time\nthere was a scan.\n", False
    yield "prose.xyz", b"Once upon a time\n", False
    for k, extension in enumerate(("ply", "obj", "stl", "off", "drc", "gz", "zst", "bin")):
        yield f"garbage.{extension}", noise(4000, k), False
    # Cut off.
    yield "cut_header.ply", text_ply[:60], True
    yield "cut_vertices.ply", text_ply[: len(text_ply) // 4], True
    yield "cut_faces.ply", text_ply[:-40], True
    yield "cut.ply", little[:-1], True
    yield "cut_most.ply", little[: len(little) // 2], True
    yield "cut.obj", text_obj[: text_obj.index(b"f ") - 30] + b"\nf 1 2 3\nf 38 39 40\n", True
    yield "cut.stl", text_stl[: len(text_stl) // 2], True
    yield "cut_binary.stl", bin_stl[:-10], True
    yield "cut_solid.stl", binary_stl(t, b"solid part")[:-10], True
    yield "cut_head.stl", bin_stl[:70], True
    yield "cut.off", text_off[:-30], True
    yield "cut.drc", b"DRACO\x02\x02\x01\x01\0\0", False
    # Positions of Draco's truth values, with bytes that are neither true nor false.
    yield "truth.drc", bytes.fromhex("445241434f0202010000000605010001020002030003040302040201"
                                     "040100040101000b0300") + bytes(11) + b"\x80" * 30, False
    # Counts that lie.
    yield "vertices.ply", ascii_ply(t, vertices=4000), True
    yield "faces.ply", ascii_ply(t, faces=4000), True
    yield "few_vertices.ply", ascii_ply(t, vertices=3), True
    yield "vertices_binary.ply", binary_ply(t, vertices=4000), True
    yield "huge_vertices.ply", binary_ply(t, vertices=1 << 47), True
    yield "huge_faces.ply", binary_ply(t, faces=4_000_000_000), True
    yield "impossible.ply", binary_ply(t, faces=10**30), True
    yield "negative.ply", ascii_ply(t, faces=-1), True
    yield "huge_list.ply", binary_ply(tri, count="I")[:-16] + b"\xff" * 16, True
    yield "huge.off", b"OFF\n999999999999 999999999999 0\n0 0 0\n", True
    yield "words.off", b"OFF\nmany few 0\n", True
    yield "corners.off", off(tri)[:-8] + b"999999999 0 1 2\n", True
    yield "huge.stl", binary_stl(t, count=0xFFFFFFF0), True
    yield "more.stl", binary_stl(t, count=len(t[1]) + 1), True
    for method in (0, 1):
        yield f"huge_{method}.drc", draco_header(1_400_000_000, 700_000_000, method), False
        yield f"large_{method}.drc", draco_header(20_000_000, 10_000_000, method), False
        yield f"lie_{method}.drc", draco_header(1000, 500, method), False
    # Indices that are not there.
    for k, bad in enumerate((40, -1, 4_000_000_000)):
        faces = t[1][:10] + [(0, 1, bad)]
        yield f"index_{k}.ply", ascii_ply((t[0], faces)), True
        yield f"index_{k}.off", off((t[0], faces)), True
        if bad != -1:
            yield f"index_{k}.obj", obj((t[0], faces)), True
    yield "binary_index.ply", binary_ply((t[0], [(0, 1, 40)])), True
    yield "zero.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", True
    yield "backwards.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", True
    # Nothing to remesh.
    yield "points.ply", ascii_ply((t[0], [])), True
    yield "points.obj", obj((t[0], [])), False
    yield "points.off", off((t[0], [])), False
    yield "nothing.stl", b"solid x\nendsolid x\n", False
    yield "nothing_binary.stl", binary_stl(([], [])), False
    yield "wireframe.obj", obj((t[0], [])) + b"l 1 2 3\nl 4 5\n", False
    yield "degenerate.obj", obj((t[0], [(0, 0, 1), (2, 2, 2)])), False
    yield "edges.ply", ascii_ply((t[0], [(0, 1), (2, 3)])), False
    yield "all_nan.ply", ascii_ply(([(NAN, NAN, NAN)] * 3, [(0, 1, 2)])), False
    yield "all_inf.obj", obj(([(INF, 0.0, 0.0)] * 3, [(0, 1, 2)])), False
    # Not quite the format.
    yield "comma.obj", b"v 0 0 0\nv 1,5 0 0\nv 0 1 0\nf 1 2 3\n", True
    yield "short.obj", b"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", True
    yield "utf16.obj", b"\xff\xfe" + text_obj.decode().encode("utf-16-le"), False
    yield "old_mac.obj", text_obj.replace(b"\n", b"\r"), False
    yield "old_mac.ply", text_ply.replace(b"\n", b"\r"), True
    yield "one_line.obj", b"v 0 0 0 " + b"0 " * (9 << 20), True
    yield "no_format.ply", text_ply.replace(b"format ascii 1.0\n", b""), True
    yield "no_z.ply", text_ply.replace(b"property float z\n", b""), True
    yield "odd_type.ply", text_ply.replace(b"float z", b"quaternion z"), True
    yield "float_index.ply", text_ply.replace(b"uchar int", b"uchar float"), True
    yield "binary.off", b"OFF BINARY\n" + noise(100, 3), True
    yield "four.off", off(t, "4OFF"), True
    yield "word.stl", text_stl.replace(b"outer", b"inner", 1), True
    yield "archive.ply", b"PK\x03\x04" + noise(100, 5), False
    # Compressed.
    packed, frame = gzip.compress(text_ply), zstd_frame(text_ply)
    yield "cut.ply.gz", packed[:-20], True
    yield "checksum.ply.gz", packed[:-8] + b"\0\0\0\0" + packed[-4:], True
    yield "flipped.ply.gz", packed[:200] + bytes([packed[200] ^ 255]) + packed[201:], True
    yield "trailing.ply.gz", packed + b"and more", True
    yield "nothing.ply.gz", gzip.compress(b""), False
    yield "twice.ply.gz", gzip.compress(packed), False
    yield "magic.gz", b"\x1f\x8b", True
    yield "cut.ply.zst", frame[:-100], True
    yield "damaged.ply.zst", frame[:6] + b"\xff\xff\xff" + frame[9:], True
    yield "trailing.ply.zst", frame + b"and more", True
    yield "window.zst", b"\x28\xb5\x2f\xfd\x00\xf8" + bytes(64), True
    yield "bomb.obj.gz", gzip.compress(b"\n" * (64 << 20), 9), False


def remeshed_files():
    """(name, bytes, (components, loops, Euler characteristic) of the remesh)"""
    t, q, s = torus(), quad_torus(), sphere()
    ring, ball, disk = (1, 0, 0), (1, 0, 2), (1, 1, 1)
    # The same torus in every dress.
    yield "ascii.ply", ascii_ply(t), ring
    yield "crlf.ply", ascii_ply(t, eol="\r\n"), ring
    yield "little.ply", binary_ply(t), ring
    yield "big.ply", binary_ply(t, ">", "d", "I", "I"), ring
    yield "short.ply", binary_ply(t, "<", "d", "h"), ring
    yield "quads.ply", binary_ply(q), ring
    yield "trailing.ply", binary_ply(t) + b"and more", ring
    yield "slashes.obj", obj(t, "{0}/{0}/7"), ring
    yield "normals.obj", obj(t, "{0}//{0}", eol="\r\n"), ring
    yield "backwards.obj", obj(t, base=-len(t[0])), ring
    yield "quads.obj", obj(q), ring
    yield "names.obj", b"\xef\xbb\xbf" + "o Büste Ж 像\n".encode() + obj(t), ring
    yield "continued.obj", obj(t).replace(b"f ", b"f \\\n "), ring
    yield "unfinished.obj", obj(t)[:-1], ring
    yield "colours.obj", obj(([p + (0.1, 0.5, 1.0) for p in t[0]], t[1])), ring
    yield "text.stl", ascii_stl(t), ring
    yield "capitals.stl", ascii_stl(t, "\r\n").upper(), ring
    yield "binary.stl", binary_stl(t), ring
    yield "solid.stl", binary_stl(t, b"solid part"), ring
    yield "uncounted.stl", binary_stl(t, count=0), ring
    yield "plain.off", off(t), ring
    yield "colours.off", off(t, "COFF", " 1 2 3 255"), ring
    yield "normals.off", off(t, "NOFF", " 0 0 1"), ring
    yield "comments.off", off(t).replace(b"OFF\n", b"# a torus\nOFF # really\n\n# counts\n"), ring
    yield "headless.off", off(t)[4:], ring
    yield "scan.ply.gz", gzip.compress(binary_ply(t)), ring
    yield "parts.obj.gz", gzip.compress(obj(t)[:1000]) + gzip.compress(obj(t)[1000:]), ring
    yield "scan.stl.gz", gzip.compress(binary_stl(t, b"solid")), ring
    yield "scan.off.zst", zstd_frame(off(t)), ring
    yield "scan.ply.zst", zstd_frame(binary_ply(t)), ring
    yield "wrong_name.obj", binary_ply(t), ring
    yield "no_name", ascii_stl(t), ring
    # Odd numbers.
    yield "nan.ply", binary_ply(with_vertex(t, 20, (NAN, 0, 0))), (1, 1, -1)
    yield "inf.obj", obj(with_vertex(t, 20, (0.0, INF, 0.0))), (1, 1, -1)
    # Spikes far thinner than a quad, which lines cross thousands of times.
    yield "far.ply", ascii_ply(with_vertex(t, 20, (1e5, 0, 0))), ring
    yield "far_from_much.ply", binary_ply(with_vertex(torus(120, 60), 20, (1e5, 0, 0))), ring
    yield "1e30.ply", ascii_ply(with_vertex(t, 20, (1e30, 0, 0))), ring
    for size in ("1e30", "1e-30", "1e100"):
        yield f"scale_{size}.obj", obj(moved(t, (float(size),) * 3)), ring
    yield "georeferenced.ply", binary_ply(moved(t, by=(4.5e6, 5.5e6, 120)), kind="d"), ring
    yield "everything_at_a_point.obj", obj(([(1.0, 2.0, 3.0)] * len(t[0]), t[1])), None
    yield "everything_on_a_line.obj", obj(moved(t, (1, 0, 0))), ring
    yield "flattened.obj", obj(moved(t, (1, 1, 0))), ring
    # Defects that are repaired.
    yield "repeated.obj", obj((t[0], t[1] + t[1][:50])), ring
    yield "flipped.obj", obj((t[0], [f[::-1] if k % 3 == 0 else f for k, f in enumerate(t[1])])), ring
    yield "index_twice.obj", obj((t[0], t[1] + [(5, 5, 9), (7, 7, 7)])), ring
    yield "isolated.obj", obj((t[0] + [(9.0, 9.0, 9.0)] * 5, t[1])), ring
    yield "soup.ply", binary_ply(soup(t)), ring
    yield "soup.obj", obj(soup(s)), ball
    yield "fin.obj", obj((t[0] + [(5.0, 5.0, 5.0)], t[1] + [(0, 1, len(t[0]))])), None
    yield "bow_tie.obj", obj(([(0.0, 0, 0), (1.0, 0, 0), (1.0, 1, 0), (-1.0, 0, 0), (-1.0, -1, 0)],
                              [(0, 1, 2), (0, 3, 4)])), (2, 2, 2)
    yield "moebius.obj", obj(moebius()), None
    yield "triangle_quads.obj", obj((t[0], [f + f[2:] for f in t[1]])), ring
    # Odd shapes.
    one = ([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [(0, 1, 2)])
    yield "one.obj", obj(one), disk
    yield "one.stl", binary_stl(one), disk
    yield "two.obj", obj(grid(1, 1)), disk
    yield "apart.obj", obj(joined(one, moved(one, by=(3, 0, 0)))), (2, 2, 2)
    yield "back_to_back.obj", obj((one[0], [(0, 1, 2), (0, 2, 1)])), None
    yield "tetrahedron.obj", obj(tetrahedron()), ball
    yield "pillow.obj", obj(([(0.0, 0, 0), (1.0, 0, 0), (1.0, 1, 0.2), (0.0, 1, 0)],
                             [(0, 1, 2, 3), (3, 2, 1, 0)])), ball
    yield "cube.obj", obj(([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)],
                           [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4),
                            (1, 5, 7, 3)])), ball
    yield "ngon.obj", obj((sphere(20)[0][1:41], [tuple(range(40))])), disk
    yield "flat.obj", obj(grid(20, 20)), disk
    yield "needles.obj", obj(grid(30, 30, sx=1e-5)), disk
    yield "strip.obj", obj(grid(400, 1)), disk
    yield "slivers.obj", obj(moved(s, (1, 1, 1e-6))), ball
    yield "nested.obj", obj(joined(s, sphere(10, 0.5), sphere(8, 0.1), sphere(6, 0.01))), (4, 0, 8)
    yield "sizes.obj", obj(joined(s, sphere(6, 1e-4, (3, 0, 0)), sphere(6, 1e3, (2e3, 0, 0)))), (3, 0, 6)
    tiny = [tetrahedron((k % 100, k // 100, 0), 0.1) for k in range(10000)]
    yield "components.ply", binary_ply(joined(*tiny)), (10000, 0, 20000)


class BadInput(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def remesh(self, case, name, data):
        """Exit code, standard error, output file, peak memory."""
        folder = self.folder / str(case)
        out = folder / "out"
        out.mkdir(parents=True)
        scan = folder / name
        scan.write_bytes(data)
        words = [RATTAN, "remesh", scan, "-o", out / "remesh.obj", "--quiet", "--threads", "1"]
        process = subprocess.Popen(
            list(map(str, words)), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS)))
        errors = process.stderr.read()
        process.stderr.close()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        scan.unlink()
        return process.returncode, errors, out, usage.ru_maxrss * 1024

    def check_refused(self, name, code, errors, out, place):
        self.assertEqual(code, 3, errors)
        lines = errors.strip().splitlines()
        self.assertEqual(len(lines), 1, errors)
        self.assertIn(name, lines[0])
        self.assertTrue(lines[0].startswith("rattan: ") and lines[0].endswith("."), errors)
        self.assertLess(len(lines[0]), 500)
        if place:
            self.assertRegex(lines[0], PLACE)
        self.assertEqual(list(out.iterdir()), [])

    def check_remeshed(self, code, errors, out, topology):
        self.assertEqual(code, 0, errors)
        vertices, faces = mesh_checks.read_obj(out / "remesh.obj")
        self.assertEqual(mesh_checks.violations(faces, len(vertices)), {})
        after = mesh_checks.topology(faces)
        if topology is not None:
            self.assertEqual((after.components, after.loops, after.euler), topology)
        self.assertEqual([p.name for p in out.iterdir()], ["remesh.obj"])

    def run_all(self, cases, check):
        cases = list(cases)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            results = list(pool.map(lambda c: self.remesh(c[0], c[1][0], c[1][1]),
                                    enumerate(cases)))
        for (name, data, expected), (code, errors, out, rss) in zip(cases, results):
            with self.subTest(file=name):
                check(name, code, errors, out, expected)
                self.assertLess(rss, MOST_RSS)
        return len(cases)

    def test_unusable_files_are_refused(self):
        count = self.run_all(refused_files(), self.check_refused)
        self.assertGreaterEqual(count, 80)

    def test_odd_files_are_remeshed(self):
        self.run_all(remeshed_files(),
                     lambda name, code, errors, out, expected:
                     self.check_remeshed(code, errors, out, expected))

    def test_prefixes_are_refused_or_remeshed(self):
        t = torus(8, 5)
        files = {"a.ply": ascii_ply(t), "b.ply": binary_ply(t), "a.obj": obj(t), "a.off": off(t),
                 "a.stl": ascii_stl(t), "b.stl": binary_stl(t), "a.ply.gz": gzip.compress(obj(t)),
                 "a.ply.zst": zstd_frame(off(t))}
        cases = [(name, data[: len(data) * k // 8], None)
                 for name, data in files.items() for k in range(1, 8)]

        def check(name, code, errors, out, _):
            if code == 0:
                self.check_remeshed(code, errors, out, None)
            else:
                self.check_refused(name, code, errors, out, False)

        self.run_all(cases, check)

    def test_paths_that_are_no_files(self):
        for path in (self.folder / "missing.ply", self.folder):
            done = subprocess.run([RATTAN, "remesh", path, "-o", self.folder / "out.obj"],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 3)
            self.assertIn(str(path), done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
