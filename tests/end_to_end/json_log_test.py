# SPDX-License-Identifier: MIT
"""`rattan remesh --log-format json`: every line of stderr is an event, in order, and every way to
end is told with its exit code."""

import datetime
import json
import os
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
STAGES = ["ingest", "field", "parameterize", "extract", "quadrangulate", "optimise", "verify",
          "write"]


def bytes_of(words):
    return [os.fsencode(w) for w in words]


class JsonLog(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.shared = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.scan = cls.shared / "scan.ply"
        subprocess.run([RATTAN, "synth", "-o", cls.scan, "--triangles", "30000", "--quiet"],
                       check=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.shared, ignore_errors=True)

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.out = self.folder / "out.obj"

    def run_remesh(self, *words):
        return subprocess.run(bytes_of([RATTAN, "remesh", *words]), capture_output=True,
                              timeout=120)

    def parse(self, stderr):
        """The events; what all of them promise is checked here."""
        self.assertTrue(stderr.endswith(b"\n"), stderr)
        events = [json.loads(line.decode("utf-8")) for line in stderr.splitlines()]
        times = []
        for event in events:
            self.assertEqual(list(event)[:3], ["time", "event", "scan"])
            self.assertRegex(event["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            times.append(datetime.datetime.strptime(event["time"], "%Y-%m-%dT%H:%M:%S.%fZ"))
        self.assertEqual(times, sorted(times))
        now = datetime.datetime.now(datetime.timezone.utc).replace(tzinfo=None)
        self.assertLess(abs((now - times[-1]).total_seconds()), 60)
        self.assertEqual(events[-1]["event"], "end")
        self.assertEqual(sum(e["event"] == "end" for e in events), 1)
        self.assertGreater(events[-1]["peak_rss_bytes"], 1 << 20)
        return events

    def events(self, *words, code):
        done = self.run_remesh("--log-format", "json", *words)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, b"")
        events = self.parse(done.stderr)
        self.assertEqual(events[-1]["exit"], code)
        errors = [e for e in events if e["event"] == "error"]
        self.assertEqual([e["exit"] for e in errors], [code] if code else [])
        self.assertTrue(all(len(e["text"]) > 10 for e in errors), errors)
        return events

    def test_a_run(self):
        report = self.folder / "report.json"
        events = self.events(self.scan, "-o", self.out, "--faces", "600,2k", "--threads", "1",
                             "--memory", "1GiB", "--report", report, code=0)
        told = json.loads(report.read_text())
        for event in events:
            self.assertEqual(event["scan"], str(self.scan))
        names = [e["event"] for e in events if e["event"] != "progress"]
        self.assertEqual(names[0], "start")
        self.assertEqual(events[0]["output"], str(self.out))
        self.assertEqual((events[0]["threads"], events[0]["memory"]), (1, 1 << 30))
        stages = [e for e in events if e["event"] == "stage"]
        self.assertEqual([s["name"] for s in stages], [s["name"] for s in told["stages"]])
        self.assertEqual([s["name"] for s in stages][:len(STAGES)], STAGES)
        for stage, expected in zip(stages, told["stages"]):
            for figure, value in expected.items():
                self.assertEqual(stage[figure], value)
            self.assertEqual(stage["triangles"], told["input"]["triangles"])
            self.assertEqual(stage["vertices"], told["input"]["vertices"])
        outputs = [e for e in events if e["event"] == "output"]
        self.assertEqual(len(outputs), 2)
        by_path = {o["path"]: o for o in told["outputs"]}
        for output in outputs:
            for figure in ("vertices", "faces", "quads", "irregular_vertices", "bytes"):
                self.assertEqual(output[figure], by_path[output["path"]][figure])
            self.assertEqual(output["bytes"], Path(output["path"]).stat().st_size)
        warnings = [e["text"] for e in events if e["event"] == "warning"]
        self.assertEqual(warnings, told["warnings"])
        self.assertGreaterEqual(events[-1]["seconds"], told["seconds"])
        # An output comes after its last stage, and before the stages of the next.
        self.assertEqual(names[names.index("output") - 1], "stage")
        self.assertEqual(names[-2:], ["output", "end"])

    def test_off_is_as_ever(self):
        for words in ([], ["--log-format", "text"], ["--log-format", "json", "--log-format=text"]):
            with self.subTest(words=words):
                done = self.run_remesh(self.scan, "-o", self.out, *words)
                self.assertEqual(done.returncode, 2 if len(words) > 2 else 0, done.stderr)
                self.assertNotIn(b"{", done.stderr)
                self.assertEqual(b" faces, " in done.stdout, done.returncode == 0)
        json_bytes = self.folder / "json.obj"
        self.events(self.scan, "-o", json_bytes, code=0)
        self.assertEqual(json_bytes.read_bytes(), self.out.read_bytes())

    def test_warnings(self):
        events = self.events(self.scan, "-o", self.out, "--faces", "1", code=0)
        warnings = [e for e in events if e["event"] == "warning"]
        self.assertTrue(any("instead of 1" in w["text"] for w in warnings), warnings)

    def test_every_exit_code(self):
        broken = self.folder / "broken.ply"
        broken.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
        for words, code, scan in (
            ([self.scan, "-o", self.out, "--faces", "many"], 2, self.scan),
            ([self.scan, "-o", self.out, "--faces", "3", "--ratio", "1"], 2, self.scan),
            ([self.scan, "-o", self.out, "--colour"], 2, self.scan),
            ([self.scan], 2, self.scan),
            (["-o", self.out], 2, None),
            ([], 2, None),
            ([self.scan, "-o", self.folder / "out.xyz"], 2, self.scan),
            ([self.folder / "none.ply", "-o", self.out], 3, self.folder / "none.ply"),
            ([broken, "-o", self.out], 3, broken),
            ([self.scan, "-o", self.folder / "no" / "out.obj"], 2, self.scan),
            ([self.scan, "-o", self.out, "--memory", "1MiB"], 4, self.scan),
            ([self.scan, "-o", self.out, "--memory", "1MiB", "--dry-run"], 4, self.scan),
        ):
            with self.subTest(words=words):
                events = self.events(*words, code=code)
                self.assertEqual({e["scan"] for e in events}, {scan and str(scan)})
                self.assertFalse(self.out.exists())
        done = subprocess.run([RATTAN, "--log-format=json", "nonsense"], capture_output=True)
        self.assertEqual(done.returncode, 2)
        self.parse(done.stderr)

    def test_a_plan(self):
        events = self.events(self.scan, "-o", self.out, "--dry-run", "--faces", "500", code=0)
        self.assertEqual([e["event"] for e in events], ["plan", "end"])
        self.assertEqual(events[0]["triangles"], 30000)
        self.assertTrue(events[0]["fits"])
        self.assertFalse(self.out.exists())

    def test_an_interruption(self):
        scan = self.folder / "large.ply"
        subprocess.run([RATTAN, "synth", "-o", scan, "--triangles", "400000", "--quiet"],
                       check=True)
        run = subprocess.Popen([RATTAN, "remesh", scan, "-o", self.out, "--log-format", "json"],
                               stderr=subprocess.PIPE, stdout=subprocess.PIPE)
        first = run.stderr.readline() + run.stderr.readline()
        run.send_signal(signal.SIGTERM)
        stdout, rest = run.communicate(timeout=60)
        self.assertEqual((run.returncode, stdout), (75, b""), rest)
        events = self.parse(first + rest)
        names = [e["event"] for e in events]
        self.assertIn("stopping", names)
        self.assertEqual(names[-2:], ["error", "end"])
        self.assertEqual([e["exit"] for e in events[-2:]], [75, 75])
        self.assertIn("resume", events[-2]["text"])

    def test_names_of_any_bytes(self):
        scan = os.fsencode(self.folder) + b"/b\xfcste \xff\"\n.ply"
        out = os.fsencode(self.folder) + b"/\xe9.obj"
        shutil.copy(self.scan, scan)
        report = self.folder / "report.json"
        events = self.events(scan, "-o", out, "--report", report, code=0)
        self.assertTrue(os.path.exists(out))
        name = os.fsdecode(os.fsencode(self.folder)) + "/b\ufffdste \ufffd\"\n.ply"
        self.assertEqual({e["scan"] for e in events}, {name})
        self.assertEqual(json.loads(report.read_text())["input"]["path"], name)
        for words, code in (([scan], 2), ([scan + b"x", "-o", out], 3),
                            ([scan, "-o", out, "--memory", "1MiB"], 4)):
            self.events(*words, code=code)

    def test_progress_is_rare(self):
        scan = self.folder / "large.ply"
        subprocess.run([RATTAN, "synth", "-o", scan, "--triangles", "800000", "--quiet"],
                       check=True)
        events = self.events(scan, "-o", self.out, "--threads", "1", code=0)
        progress = [e for e in events if e["event"] == "progress"]
        self.assertGreater(len(progress), 0)
        self.assertLessEqual(len(progress), events[-1]["seconds"] + 1)
        for event in progress:
            self.assertLessEqual(event["done"], event["total"])
            self.assertTrue(event["stage"])
        quiet = self.events(scan, "-o", self.out, "--threads", "1", "--quiet", code=0)
        self.assertFalse(any(e["event"] == "progress" for e in quiet))


if __name__ == "__main__":
    unittest.main(verbosity=2)
