# SPDX-License-Identifier: MIT
"""rattan render and --preview from outside: sizes, what is drawn, exit codes, sentences."""

import os
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import zlib
from pathlib import Path

RATTAN = os.environ["RATTAN"]


def rattan(*words):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=300)


def read_png(path):
    """Width, height and rows of RGB bytes of an 8-bit PNG without interlacing."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert (depth, colour, interlaced) == (8, 2, 0)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw = zlib.decompress(packed)
    stride, rows, before = 3 * width, [], bytes(3 * width)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        line = bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left = line[i - 3] if i >= 3 else 0
            up, corner = before[i], before[i - 3] if i >= 3 else 0
            if kind == 1:
                add = left
            elif kind == 2:
                add = up
            elif kind == 3:
                add = (left + up) // 2
            elif kind == 4:
                p = left + up - corner
                near = [abs(p - left), abs(p - up), abs(p - corner)]
                add = (left, up, corner)[near.index(min(near))]
            else:
                add = 0
            line[i] = line[i] + add & 255
        rows.append(bytes(line))
        before = rows[-1]
    return width, height, rows


def drawn(rows):
    """Share of the pixels that are not white."""
    pixels = sum(len(r) // 3 for r in rows)
    return sum(r[i : i + 3] != b"\xff\xff\xff" for r in rows for i in range(0, len(r), 3)) / pixels


def touches_rim(rows):
    inner = all(r[:3] == r[-3:] == b"\xff\xff\xff" for r in rows)
    return not inner or any(set(r) != {255} for r in (rows[0], rows[-1]))


class Render(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.scan, cls.out = cls.folder / "scan.ply", cls.folder / "out.drc"
        rattan("synth", "-o", cls.scan, "--triangles", 8000, "--holes", 1, "--quiet")
        done = rattan("remesh", cls.scan, "-o", cls.out, "--quiet", "--keep-work")
        assert done.returncode == 0, done.stderr
        cls.work = cls.folder / "out.drc.work"

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def render(self, *words):
        png = self.folder / "picture.png"
        done = rattan("render", *words, "-o", png)
        self.assertEqual(done.returncode, 0, done.stderr)
        return read_png(png)

    def test_files_and_sizes(self):
        for path, size, expected in ((self.out, "120", (120, 120)),
                                     (self.scan, "160x90", (160, 90))):
            width, height, rows = self.render(path, "--size", size)
            self.assertEqual((width, height), expected)
            self.assertLess(0.2, drawn(rows))
            self.assertLess(drawn(rows), 0.95)
            self.assertFalse(touches_rim(rows))

    def test_views_and_edges_differ(self):
        pictures = [self.render(self.out, "--size", 100, *words)[2]
                    for words in ((), ("--view", "back"), ("--view", "30,-20"), ("--up", "x"),
                                  ("--edges", "never"))]
        for i, a in enumerate(pictures):
            for b in pictures[:i]:
                self.assertNotEqual(a, b)
        self.assertEqual(self.render(self.out, "--size", 100)[2], pictures[0])

    def test_a_kept_work_directory(self):
        before = {p.name: p.read_bytes() for p in self.work.iterdir()}
        width, height, rows = self.render(self.work, "--size", 100)
        self.assertEqual(width % 3, 0)
        panel, tall = width // 3, height // 2
        for i in range(6):
            part = [r[3 * panel * (i % 3) : 3 * panel * (i % 3 + 1)]
                    for r in rows[tall * (i // 3) : tall * (i // 3 + 1) - 29]]
            self.assertLess(0.2, drawn(part), f"panel {i}")
        self.assertEqual({p.name: p.read_bytes() for p in self.work.iterdir()}, before)
        # As far as the work of a run came that was killed.
        for made, least in (("graph.*.h5", 1), ("param.*.h5", 3)):
            out = self.folder / f"killed{least}.drc"
            process = subprocess.Popen(
                [RATTAN, "remesh", self.scan, "-o", out, "--quiet", "--keep-work"],
                env=dict(os.environ, RATTAN_CHECKPOINT_SECONDS="0"))
            work = Path(str(out) + ".work")
            while process.poll() is None and not (
                    (work / "checkpoint").exists() and list(work.glob(made))):
                time.sleep(0.002)
            process.kill()
            process.wait()
            panels = round(self.render(work, "--size", 100)[0] / panel)
            self.assertGreaterEqual(panels, least)

    def test_preview(self):
        png = self.folder / "preview.png"
        done = rattan("remesh", self.scan, "-o", self.folder / "again.drc", "--quiet",
                      "--preview", png)
        self.assertEqual(done.returncode, 0, done.stderr)
        header = png.read_bytes()[:24]
        width, height = struct.unpack(">II", header[16:24])
        self.assertEqual(width % 3, 0)
        self.assertGreater(height, 640)

    def test_a_layout(self):
        png, out = self.folder / "layout.png", self.folder / "layout.obj"
        done = rattan("layout", self.scan, "-o", out, "--quiet", "--keep-work", "--preview", png)
        self.assertEqual(done.returncode, 0, done.stderr)
        width, _, _ = read_png(png)
        self.assertEqual(width % 3, 0)
        width, height, rows = self.render(str(out) + ".work", "--size", 100)
        panel, tall = width // 3, height // 2
        panels = []
        for i in range(6):
            panels.append([r[3 * panel * (i % 3) : 3 * panel * (i % 3 + 1)]
                           for r in rows[tall * (i // 3) : tall * (i // 3 + 1) - 29]])
            self.assertLess(0.2, drawn(panels[-1]), f"panel {i}")
            self.assertNotIn(panels[-1], panels[:-1])
        self.assertRaisesRegex(AssertionError, "textures are shown on files", self.render,
                               str(out) + ".work", "--texture", "checker")

        board = self.render(out, "--size", 150, "--texture", "checker")[2]
        shown = [r[i : i + 3] for r in board for i in range(0, len(r), 3)
                 if r[i : i + 3] != b"\xff\xff\xff"]
        blue = sum(p[2] > p[0] + 25 for p in shown) / len(shown)
        self.assertLess(0.35, blue)
        self.assertLess(blue, 0.6)
        for words in (("--checks", "1"), ("--edges", "never"), ("--texture", png)):
            other = self.render(out, "--size", 150, "--texture", "checker", *words)[2] \
                if words[0] != "--texture" else self.render(out, "--size", 150, *words)[2]
            self.assertNotEqual(other, board)

    def test_textures_of_an_atlas(self):
        for name in ("atlas.drc", "atlas.ply"):
            out = self.folder / name
            done = rattan("layout", self.scan, "-o", out, "--quiet", "--atlas")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertLess(0.2, drawn(self.render(out, "--size", 100, "--texture", "checker")[2]))

    def test_errors_are_sentences(self):
        png = self.folder / "error.png"
        text = self.folder / "text.obj"
        text.write_text("no mesh\n")
        for words, code in (
            ([], 2),
            ([self.out], 2),
            ([self.out, "-o", self.folder / "error.jpg"], 2),
            ([self.out, "-o", self.folder / "no" / "error.png"], 2),
            ([self.out, "-o", png, "--size", "0"], 2),
            ([self.out, "-o", png, "--size", "100x"], 2),
            ([self.out, "-o", png, "--size", "100x100000"], 2),
            ([self.out, "-o", png, "--view", "inside"], 2),
            ([self.out, "-o", png, "--view", "1,95"], 2),
            ([self.out, "-o", png, "--up", "w"], 2),
            ([self.folder / "none.drc", "-o", png], 3),
            ([text, "-o", png], 3),
            ([self.folder, "-o", png], 3),
            ([self.out, "-o", png, "--texture", "checker"], 3),
            ([self.scan, "-o", png, "--texture", "checker"], 3),
            ([self.scan, "-o", png, "--texture", self.folder / "none.png"], 3),
            ([self.scan, "-o", png, "--texture", text], 3),
            ([self.work, "-o", png, "--texture", "checker"], 2),
            ([self.out, "-o", png, "--checks", "4"], 2),
            ([self.out, "-o", png, "--texture", "checker", "--checks", "0"], 2),
        ):
            with self.subTest(words=words):
                done = rattan("render", *words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn("rattan: ", done.stderr)
                self.assertNotIn("terminate", done.stderr)
                self.assertFalse(png.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
