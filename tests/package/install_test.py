# SPDX-License-Identifier: MIT
"""`cmake --install`, moved to another place, and find_package(rattan) from there: the example makes
the same bytes as the program, stops when asked to and goes on, and tells errors apart."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
BUILD = Path(os.environ["RATTAN_BUILD"])


def run(*words, **kwargs):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=300,
                          **kwargs)


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.do("cmake", "--install", BUILD, "--prefix", cls.folder / "first")
        cls.prefix = cls.folder / "second"
        (cls.folder / "first").rename(cls.prefix)
        source, build = cls.prefix / "share/doc/rattan/example", cls.prefix / "example"
        cls.do("cmake", "-S", source, "-B", build, "-DCMAKE_BUILD_TYPE=Release",
               f"-DCMAKE_PREFIX_PATH={cls.prefix}", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
        cls.do("cmake", "--build", build)
        cls.prefix = cls.prefix.rename(cls.folder / "third")
        cls.scan = cls.folder / "scan.ply"
        cls.do(RATTAN, "synth", "-o", cls.scan, "--triangles", 20000, "--genus", 1, "--quiet")

    @classmethod
    def do(cls, *words):
        done = run(*words)
        if done.returncode != 0:
            raise AssertionError(f"{words}\n{done.stdout}\n{done.stderr}")
        return done

    def example(self, scan, out, *more):
        return run(self.prefix / "example/remesh_example", scan, self.folder / out, 800, *more)

    def program(self):
        """What the installed program makes of the same."""
        out = self.folder / "program.drc"
        if not out.exists():
            self.do(self.prefix / "bin/rattan", "remesh", self.scan, "-o", out, "--faces", 800,
                    "--quiet")
        return out.read_bytes()

    def test_same_bytes(self):
        done = self.example(self.scan, "library.drc")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"library\.drc: \d+ faces")
        self.assertEqual((self.folder / "library.drc").read_bytes(), self.program())

    def test_stop_and_resume(self):
        done = self.example(self.scan, "stopped.drc", 0)
        self.assertEqual(done.returncode, 75, done.stderr)
        self.assertFalse((self.folder / "stopped.drc").exists())
        self.assertTrue((self.folder / "stopped.drc.work").exists())
        done = self.example(self.scan, "stopped.drc")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / "stopped.drc").read_bytes(), self.program())
        self.assertFalse((self.folder / "stopped.drc.work").exists())

    def test_errors(self):
        broken = self.folder / "broken.ply"
        broken.write_bytes(b"ply\nformat none\n")
        for scan, out, what in ((broken, "a.drc", "the scan cannot be used"),
                                (self.scan, "a.xyz", "an option is wrong"),
                                ("", "a.drc", "an option is wrong")):
            done = self.example(scan, out)
            self.assertEqual(done.returncode, 1)
            self.assertTrue(done.stderr.startswith(what), done.stderr)

    def test_headers_stand_alone(self):
        headers = sorted((self.prefix / "include/rattan").iterdir())
        self.assertIn("remesh.h", [h.name for h in headers])
        for header in headers:
            done = run("c++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                       "-I", self.prefix / "include", "-include", f"rattan/{header.name}",
                       "-x", "c++", "/dev/null")
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_nothing_points_to_the_build(self):
        for file in (self.prefix / "lib/cmake/rattan").iterdir():
            text = file.read_text()
            for path in (BUILD, BUILD.parent.parent, self.folder):
                self.assertNotRegex(text, re.escape(str(path)) + r"\b", file.name)


if __name__ == "__main__":
    unittest.main()
