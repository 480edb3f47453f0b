# SPDX-License-Identifier: MIT
"""What a batch tells programs: --metrics for Prometheus, --log-format json."""

import json
import os
import shutil
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import prometheus
from scan_samples import binary_ply, sphere, torus

RATTAN = os.environ["RATTAN"]
FACES = ("--faces", "60")
STAGES = {"ingest", "field", "parameterize", "extract", "quadrangulate", "optimise", "verify",
          "write"}


class Strictness(unittest.TestCase):
    """The reader refuses what it is there to find."""

    def test_good(self):
        prometheus.parse(b'# HELP a_total x y.\n# TYPE a_total counter\na_total{b="\\"\\n"} 1e3\n')

    def test_bad(self):
        head = "# HELP a h\n# TYPE a gauge\n"
        for text in ("a 1\n", head + "a 1", head + "b 1\n", head + "a one\n", head + "a 1\na 1\n",
                     head + 'a{b="c} 1\n', head + 'a{b="\\x"} 1\n', head + "a 1 2\n",
                     head + "a  1\n", head + "\n", "# TYPE a gauge\na 1\n", head + head,
                     "# HELP a h\n# TYPE a counter\na 1\n",
                     "# HELP h x\n# TYPE h histogram\n" 'h_bucket{le="1"} 2\nh_bucket{le="+Inf"} 1\n'
                     "h_sum 1\nh_count 1\n"):
            with self.subTest(text=text), self.assertRaises(prometheus.Malformed):
                prometheus.parse(text.encode())


class Observe(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.scans = self.folder / "scans"
        self.out = self.folder / "out"
        (self.scans / "sub").mkdir(parents=True)
        self.prom = self.folder / "rattan.prom"

    def add(self, name, data):
        path = os.path.join(os.fsencode(self.scans), os.fsencode(name))
        with open(path, "wb") as file:
            file.write(data)

    def add_mixed(self):
        self.add("torus.ply", binary_ply(torus(24, 12)))
        self.add("sub/sphere.ply", binary_ply(sphere(12)))
        self.add("sub/torus.ply", binary_ply(torus(30, 14)))
        self.add("empty.ply", b"")
        self.add("cut.ply", binary_ply(torus())[:-100])

    def batch(self, *options, code=0):
        words = [RATTAN, "batch", self.scans, "-o", self.out, *FACES, *options]
        done = subprocess.run([os.fsencode(w) for w in words], capture_output=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def metrics(self):
        self.assertEqual([p.name for p in self.folder.glob("*.tmp")], [])
        return prometheus.parse(self.prom.read_bytes())

    def value(self, families, name, **labels):
        """The one sample of that name with these labels among its own."""
        for _, _, samples in families.values():
            found = [v for (sample, have), v in samples.items()
                     if sample == "rattan_" + name and set(labels.items()) <= set(have)]
            if found:
                self.assertEqual(len(found), 1, (name, labels))
                return found[0]
        self.fail(f"no {name} with {labels}")

    def reports(self):
        return {str(p.parent.relative_to(self.out / "report")): json.loads(p.read_text())
                for p in (self.out / "report").rglob("report.json")}

    def test_metrics_of_a_batch(self):
        self.add_mixed()
        self.batch("--metrics", self.prom, code=3)
        families = self.metrics()
        value = lambda *a, **k: self.value(families, *a, **k)
        directory = {"directory": str(self.out)}
        for _, _, samples in families.values():
            for (_, labels) in samples:
                self.assertLessEqual(set(directory.items()), set(labels))
        counts = {status: value("batch_scans", status=status)
                  for status in ("done", "done_before", "unusable", "resource", "defect",
                                 "interrupted", "failed_before", "running", "elsewhere", "pending")}
        self.assertEqual({k: v for k, v in counts.items() if v}, {"done": 3, "unusable": 2})
        self.assertEqual(value("batch_attempts_total", exit="0"), 3)
        self.assertEqual(value("batch_attempts_total", exit="3"), 2)
        reports = self.reports()
        self.assertEqual(len(reports), 3)
        self.assertEqual(value("batch_triangles_total"),
                         sum(r["input"]["triangles"] for r in reports.values()))
        for name in ("faces", "quads"):
            self.assertEqual(value(f"batch_{name}_total"),
                             sum(r["output"][name] for r in reports.values()))
        self.assertEqual(value("batch_output_bytes_total"),
                         sum(p.stat().st_size for p in self.out.rglob("*.drc") if p.is_file()))
        self.assertEqual(value("batch_input_bytes_total"),
                         sum((self.scans / n).stat().st_size
                             for n in ("torus.ply", "sub/sphere.ply", "sub/torus.ply")))
        for stage in STAGES:
            for figure, key in (("seconds", "seconds"), ("cpu_seconds", "cpu_seconds"),
                                ("moved_bytes", "bytes_moved")):
                # The broken scans add nothing: their first stage doesn't end.
                self.assertAlmostEqual(
                    value(f"batch_stage_{figure}_total", stage=stage),
                    sum(s[key] for r in reports.values() for s in r["stages"]
                        if s["name"] == stage), places=6)
        self.assertEqual(value("batch_scan_seconds_count"), 5)
        self.assertGreater(value("batch_scan_seconds_sum"), 0)
        self.assertGreaterEqual(value("batch_peak_rss_bytes"),
                                max(r["peak_rss_bytes"] for r in reports.values()))
        self.assertGreater(value("batch_cpu_seconds_total"), 0)
        self.assertEqual(value("batch_finished"), 1)
        self.assertEqual(value("batch_exit_code"), 3)
        self.assertLess(abs(value("batch_update_time_seconds") - time.time()), 60)
        self.assertIn(("rattan_build_info"), families)
        # Again: nothing is done, so nothing is counted but what was there before.
        self.batch("--metrics", self.prom, code=3)
        families = self.metrics()
        self.assertEqual(value("batch_scans", status="done_before"), 3)
        self.assertEqual(value("batch_scans", status="failed_before"), 2)
        self.assertEqual(value("batch_triangles_total"), 0)

    def test_metrics_while_it_runs(self):
        """Always whole, and of the present."""
        # The first takes some seconds, and the file is written every second.
        for k, triangles in enumerate(("1500000", "300000", "300000")):
            subprocess.run([RATTAN, "synth", "-o", self.scans / f"{k}.ply", "--triangles", triangles,
                            "--seed", str(k), "--quiet"], check=True)
        run = subprocess.Popen([RATTAN, "batch", self.scans, "-o", self.out, "--ratio", "0.05",
                                "--threads", "1", "--quiet", "--metrics", self.prom])
        seen = []
        try:
            while run.poll() is None:
                if self.prom.exists():
                    families = prometheus.parse(self.prom.read_bytes())
                    seen.append((self.value(families, "batch_update_time_seconds"),
                                 self.value(families, "batch_finished"),
                                 self.value(families, "batch_scans", status="running"),
                                 self.value(families, "batch_scans", status="done")))
                time.sleep(0.02)
        finally:
            if run.poll() is None:
                run.kill()
            run.wait()
        self.assertEqual(run.returncode, 0)
        self.assertEqual(seen, sorted(seen, key=lambda s: s[0]))
        self.assertEqual([s[3] for s in seen], sorted(s[3] for s in seen))
        self.assertIn(1, [s[2] for s in seen])
        self.assertEqual(self.value(self.metrics(), "batch_scans", status="done"), 3)

    def test_labels_are_escaped(self):
        self.out = self.folder / 'o"u\\t\n\udcff'
        self.add("torus.ply", binary_ply(torus()))
        self.batch("--metrics", self.prom, "--shard", "1/1")
        families = self.metrics()
        self.assertEqual(self.value(families, "batch_scans", status="done", shard="1/1",
                                    directory=str(self.folder) + '/o"u\\t\n\ufffd'), 1)

    def test_no_place_for_metrics(self):
        self.add("torus.ply", binary_ply(torus()))
        done = self.batch("--metrics", self.folder / "no" / "x.prom", code=4)
        self.assertIn(b"--metrics", done.stderr)
        self.assertFalse(self.out.exists())

    def events(self, *options, code=0):
        done = self.batch("--log-format", "json", *options, code=code)
        self.assertEqual(done.stdout, b"")
        self.assertTrue(done.stderr.endswith(b"\n"))
        events = [json.loads(line.decode("utf-8")) for line in done.stderr.splitlines()]
        for event in events:
            self.assertEqual(list(event)[:3], ["time", "event", "scan"])
            self.assertRegex(event["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
        self.assertEqual((events[-1]["event"], events[-1]["exit"]), ("end", code))
        return events

    def test_json_log(self):
        self.add_mixed()
        events = self.events(code=3)
        names = [e["event"] for e in events]
        self.assertEqual(names[0], "batch_start")
        self.assertEqual(names[-2:], ["batch_end", "end"])
        start, end = events[0], events[-2]
        self.assertEqual((start["items"], start["pending"], start["output"]),
                         (5, 5, str(self.out)))
        self.assertEqual((end["done"], end["unusable"], end["pending"], end["exit"]), (3, 2, 0, 3))
        ids = {"torus.drc", "sub/sphere.drc", "sub/torus.drc", "empty.drc", "cut.drc"}
        self.assertEqual({e["id"] for e in events if "id" in e}, ids)
        for name in ids:
            own = [e for e in events if e.get("id") == name]
            good = name not in ("empty.drc", "cut.drc")
            self.assertEqual({e["scan"] for e in own},
                             {str((self.scans / name).with_suffix(".ply"))})
            self.assertEqual([own[0]["event"], own[1]["event"]], ["scan_start", "start"])
            self.assertEqual([own[-2]["event"], own[-1]["event"]], ["end", "scan_end"])
            self.assertEqual(own[0]["attempt"], 1)
            self.assertEqual(own[0]["command"][1], "remesh")
            last = own[-1]
            self.assertEqual((last["exit"], last["attempt"]), (0 if good else 3, 1))
            if good:
                self.assertEqual({e["name"] for e in own if e["event"] == "stage"} - {"page files"},
                                 STAGES)
                self.assertEqual(last["outputs"],
                                 [{"path": name, "bytes": (self.out / name).stat().st_size}])
            else:
                errors = [e for e in own if e["event"] == "error"]
                self.assertEqual([e["exit"] for e in errors], [3])
                self.assertEqual(last["text"], errors[0]["text"])
                self.assertTrue(Path(last["log"]).exists())
        again = self.events(code=3)
        self.assertEqual([e["event"] for e in again], ["batch_start", "batch_end", "end"])
        self.assertEqual((again[0]["done_before"], again[0]["failed_before"]), (3, 2))

    def test_json_log_of_errors(self):
        self.add("a.ply", b"")
        self.add("a.obj", b"")
        for options in (["--colour"], ["--shard", "3/2"], []):  # the last: both are to be a.drc
            with self.subTest(options=options):
                events = self.events(*options, code=2)
                self.assertEqual([e["event"] for e in events][-2:], ["error", "end"])
                self.assertEqual(events[-2]["exit"], 2)

    def test_json_log_of_names_of_any_bytes(self):
        self.add(b"b\xfcste.ply", binary_ply(torus()))
        events = self.events()
        ended = [e for e in events if e["event"] == "scan_end"]
        self.assertEqual([(e["id"], e["id_hex"], e["exit"]) for e in ended],
                         [("b\ufffdste.drc", b"b\xfcste.drc".hex(), 0)])


if __name__ == "__main__":
    unittest.main(verbosity=2)
