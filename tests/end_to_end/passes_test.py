# SPDX-License-Identifier: MIT
"""Passes over the finest level are the same for scans of every size, and few."""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
SIZES = [100_000, 400_000, 1_600_000]
MOST = {"field": 21, "parameterize": 3}


def passes(folder, triangles):
    scan, report = folder / "scan.ply", folder / "report.json"
    subprocess.run([RATTAN, "synth", "-o", scan, "--triangles", str(triangles), "--quiet"],
                   check=True, capture_output=True, timeout=300)
    subprocess.run([RATTAN, "remesh", scan, "-o", folder / "out.drc", "--quiet", "--report", report,
                    "--ratio", "0.02"], check=True, capture_output=True, timeout=600)
    read = json.loads(report.read_text())
    # The last solve of the size: a search for the number of faces may need several.
    stages = {stage["name"]: stage["passes"] for stage in read["stages"]}
    return ({name: stages[name] for name in MOST},
            {solve["system"]: solve["passes"] for solve in read["solver"]})


class Passes(unittest.TestCase):
    def test_bounded(self):
        with tempfile.TemporaryDirectory(prefix="rattan-test.") as folder:
            found = [passes(Path(folder), triangles) for triangles in SIZES]
        print(found)
        for stages, solver in found:
            self.assertEqual((stages, solver), found[0])
            for name, most in MOST.items():
                self.assertLessEqual(stages[name], most)
            self.assertEqual(solver, {"smoothing": 1, "curl": 3, "parameterization": 1})


if __name__ == "__main__":
    unittest.main(verbosity=2)
