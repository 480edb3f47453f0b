# SPDX-License-Identifier: MIT
"""--memory from outside: the bound on the resident set, the same bytes, refusals, --dry-run."""

import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
MIB = 1 << 20


def run(*words):
    done = subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=300)
    return done.returncode, done.stdout, done.stderr


def peak_of(*words):
    """Runs rattan as the only child of a process that reports that child's peak."""
    script = ("import os, resource, subprocess, sys\n"
              "code = subprocess.run(sys.argv[1:]).returncode\n"
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)\n"
              "sys.exit(code)\n")
    done = subprocess.run(["python3", "-c", script, RATTAN, *map(str, words)],
                          capture_output=True, text=True, timeout=300)
    return done.returncode, int(done.stdout.split()[-1]), done.stderr


class Memory(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.scan = cls.folder / "scan.ply"
        code, _, error = run("synth", "-o", cls.scan, "--triangles", 800000, "--holes", 2,
                             "--genus", 1, "--quiet")
        assert code == 0, error

    def remesh(self, name, *words):
        out = self.folder / name
        report = self.folder / (name + ".json")
        code, peak, error = peak_of("remesh", self.scan, "-o", out, "--quiet", "--report", report,
                                    *words)
        self.assertEqual(code, 0, error)
        self.assertFalse((self.folder / (name + ".work")).exists())
        return out.read_bytes(), peak, json.loads(report.read_text())

    def test_the_bound_holds_and_bytes_agree(self):
        everything, _, _ = self.remesh("whole.drc", "--faces", 20000)
        for budget in 112, 160, 256, 1024:
            data, peak, report = self.remesh(f"{budget}.drc", "--faces", 20000, "--memory",
                                             f"{budget}MiB")
            self.assertEqual(data, everything, f"{budget} MiB")
            self.assertLessEqual(peak, budget * MIB, f"{peak / MIB:.0f} of {budget} MiB")
            self.assertEqual(report["memory_budget_bytes"], budget * MIB)
            if budget == 112:
                moved = sum(s["bytes_written"] for s in report["stages"])
                self.assertGreater(moved, 0, "so small a budget needs the disk")

    def test_the_bound_holds_where_the_output_is_large(self):
        _, peak, _ = self.remesh("large.drc", "--faces", 160000, "--memory", "256MiB")
        self.assertLessEqual(peak, 256 * MIB)

    def test_the_bound_holds_with_a_preview(self):
        _, peak, _ = self.remesh("seen.drc", "--faces", 20000, "--memory", "240MiB", "--preview",
                                 self.folder / "seen.png")
        self.assertLessEqual(peak, 240 * MIB)

    def test_too_small_a_budget_is_refused_with_the_one_that_will_do(self):
        out = self.folder / "refused.drc"
        code, _, error = run("remesh", self.scan, "-o", out, "--faces", 100000, "--memory", "64MiB")
        self.assertEqual(code, 4)
        self.assertIn("scan.ply", error)
        self.assertFalse(out.exists())
        enough = re.search(r"--memory (\d+)MiB", error)
        self.assertIsNotNone(enough, error)
        # What is known after reading may add to what was known before it.
        words = ["remesh", self.scan, "-o", out, "--faces", 100000, "--quiet", "--memory"]
        code, peak, error = peak_of(*words, enough.group(1) + "MiB")
        if code == 4:
            enough = re.search(r"--memory (\d+)MiB", error)
            code, peak, error = peak_of(*words, enough.group(1) + "MiB")
        self.assertEqual(code, 0, error)
        self.assertLessEqual(peak, int(enough.group(1)) * MIB)

    def test_a_dry_run_tells_and_leaves_nothing(self):
        before = sorted(self.folder.iterdir())
        out = self.folder / "dry.drc"
        code, text, _ = run("remesh", self.scan, "-o", out, "--dry-run")
        self.assertEqual(code, 0)
        for word in "scan", "remesh", "tiles", "memory", "disk", "passes", "time":
            self.assertRegex(text, rf"(?m)^{word} ")
        code, text, _ = run("remesh", self.scan, "-o", out, "--dry-run", "--memory", "40MiB")
        self.assertEqual(code, 4)
        self.assertIn("TOO LITTLE", text)
        self.assertEqual(sorted(self.folder.iterdir()), before)


if __name__ == "__main__":
    unittest.main()
