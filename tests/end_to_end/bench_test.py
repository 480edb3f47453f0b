# SPDX-License-Identifier: MIT
"""rattan-bench: what it measures is what `rattan` reports, its JSON is Google Benchmark's, and
--compare says what became worse. Nothing here depends on how fast the machine is."""

import copy
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

BENCH = os.environ.get("RATTAN_BENCH") or str(Path(os.environ["RATTAN"]).parent / "rattan-bench")
KERNELS = Path(BENCH + "-kernels")
STAGES = ["ingest", "field", "parameterize", "extract", "quadrangulate", "optimise", "verify",
          "write"]


def bench(*words):
    return subprocess.run([BENCH, *map(str, words)], capture_output=True, text=True, timeout=300)


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.scans = cls.folder / "scans"
        cls.json = cls.folder / "old.json"
        cls.done = bench("--sizes", "3k,6000", "--threads", "1,2", "--memory", "default,256MiB",
                         "--repeats", 2, "--directory", cls.scans, "--json", cls.json)
        assert cls.done.returncode == 0, cls.done.stderr
        cls.document = json.loads(cls.json.read_text())

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def compare(self, old, new, *options):
        paths = []
        for name, document in (("a", old), ("b", new)):
            paths.append(self.folder / f"{name}.json")
            paths[-1].write_text(json.dumps(document))
        done = bench("--compare", paths[0], "--new", paths[1], *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def runs(self, name):
        return [b for b in self.document["benchmarks"]
                if b["run_name"] == name and b["run_type"] == "iteration"]

    def test_json_is_google_benchmarks(self):
        context = self.document["context"]
        for name in ("date", "host_name", "executable", "num_cpus", "mhz_per_cpu", "caches",
                     "load_avg", "library_build_type", "cpu_model", "memory_bytes",
                     "rattan_version", "rattan_commit"):
            self.assertIn(name, context)
        self.assertGreater(context["memory_bytes"], 1 << 28)
        names = [b["name"] for b in self.document["benchmarks"]]
        for size in (3000, 6000):
            for threads in (1, 2):
                for memory in ("", "/memory:256MiB"):
                    base = f"remesh/triangles:{size}/threads:{threads}{memory}"
                    for name in [base, *(f"{base}/stage:{s}" for s in STAGES)]:
                        self.assertEqual(names.count(name), 2, name)
                        for part in ("min", "median", "max"):
                            self.assertEqual(names.count(f"{name}_{part}"), 1)
            if shutil.which("draco_encoder"):
                self.assertEqual(names.count(f"draco_encoder/triangles:{size}"), 2)
        for entry in self.document["benchmarks"]:
            for name in ("run_name", "run_type", "repetitions", "threads", "iterations",
                         "real_time", "cpu_time", "time_unit"):
                self.assertIn(name, entry)
            self.assertEqual(entry["time_unit"], "s")
            self.assertGreaterEqual(entry["real_time"], 0)

    def test_stages_make_up_the_run(self):
        base = "remesh/triangles:6000/threads:1"
        for repeat, whole in enumerate(self.runs(base)):
            self.assertEqual(whole["repetition_index"], repeat)
            stages = [self.runs(f"{base}/stage:{s}")[repeat] for s in STAGES]
            self.assertLess(sum(s["real_time"] for s in stages), whole["real_time"])
            for stage in stages:
                self.assertAlmostEqual(stage["share"], stage["real_time"] / whole["real_time"])
            # A triangle's 13 bytes and a vertex' 15 at least pass through the first stage.
            moved = stages[0]["bytes_per_second"] * stages[0]["real_time"]
            self.assertGreater(moved, (self.scans / "synth_6000.ply").stat().st_size)
            self.assertAlmostEqual(whole["items_per_second"] * whole["real_time"], 6000, delta=60)
            self.assertGreater(whole["peak_rss_bytes"], 5 << 20)

    def test_aggregates(self):
        base = "remesh/triangles:3000/threads:2"
        times = sorted(r["real_time"] for r in self.runs(base))
        by_name = {b["name"]: b for b in self.document["benchmarks"]}
        self.assertEqual(by_name[base + "_min"]["real_time"], times[0])
        self.assertEqual(by_name[base + "_max"]["real_time"], times[-1])
        self.assertAlmostEqual(by_name[base + "_median"]["real_time"], sum(times) / 2)
        self.assertEqual(by_name[base + "_min"]["aggregate_name"], "min")

    def test_table(self):
        text = self.done.stdout
        for stage in STAGES:
            self.assertEqual(len(re.findall(rf"^  {stage} ", text, re.M)), 8)
        self.assertEqual(len(re.findall(r"2 threads are [\d.]+ times as fast as 1", text)), 4)
        self.assertEqual(len(re.findall(r"the cost of one grows [\d.]+ times", text)), 4)
        self.assertIn("median of 2", text)
        self.assertIn("MiB/s", text)

    def test_compare_with_itself(self):
        text = self.compare(self.document, self.document)
        self.assertIn(" 0 better, 0 worse by more than 10 %", text)
        self.assertEqual(set(re.findall(r" (\d+\.\d{3}) +\d+\.\d{3}$", text, re.M)), {"1.000"})
        self.assertNotIn("only in", text)

    def test_compare_finds_what_became_worse(self):
        slower, faster = "remesh/triangles:6000/threads:1", "remesh/triangles:3000/threads:1"
        new = copy.deepcopy(self.document)
        longest = max(r["real_time"] for r in self.runs(slower))
        for entry in new["benchmarks"]:
            if entry["run_name"] == slower:
                entry["real_time"] = 3 * longest
                entry["peak_rss_bytes"] *= 1.05
            elif entry["run_name"] == faster:
                entry["real_time"] /= 100
        text = self.compare(self.document, new)
        self.assertRegex(text, rf"(?m)^{slower} .*  worse$")
        self.assertRegex(text, rf"(?m)^{faster} .*  better$")
        self.assertRegex(text, rf"(?m)^{slower} peak_rss_bytes .* 1\.050 *$")
        self.assertIn(" 1 better, 1 worse by more than 10 %", text)
        self.assertTrue(text.endswith(f"\n  {slower}\n"), text)
        self.assertIn(" 2 worse by more than 1 %", self.compare(self.document, new, "--tolerance",
                                                                 "0.01"))
        self.assertIn(" 0 worse", self.compare(self.document, new, "--tolerance", "90"))

    def test_compare_is_not_misled_by_one_slow_repeat(self):
        name = "remesh/triangles:6000/threads:1"
        new = copy.deepcopy(self.document)
        first = [e for e in new["benchmarks"] if e["run_name"] == name][0]
        first["real_time"] *= 50
        self.assertIn(" 0 worse", self.compare(self.document, new))

    def test_compare_names_what_is_missing(self):
        gone = "remesh/triangles:6000/threads:2/memory:256MiB"
        new = copy.deepcopy(self.document)
        new["benchmarks"] = [b for b in new["benchmarks"] if not b["run_name"].startswith(gone)]
        text = self.compare(self.document, new)
        self.assertEqual(re.findall("only in the .*", text), [f"only in the old: {gone}"])
        text = self.compare(new, self.document)
        self.assertEqual(re.findall("only in the .*", text), [f"only in the new: {gone}"])

    def test_compare_reads_google_benchmarks_own(self):
        def document(ns):
            return {"context": {"num_cpus": 2},
                    "benchmarks": [{"name": "kernel/8", "run_name": "kernel/8",
                                    "run_type": "iteration", "iterations": 9, "real_time": ns,
                                    "cpu_time": ns, "time_unit": "ns"}]}
        text = self.compare(document(100.0), document(250.0))
        self.assertRegex(text, r"(?m)^kernel/8 +100 ns +250 ns +2\.500 +2\.500  worse$")

    def test_compare_while_measuring(self):
        done = bench("--sizes", "3000", "--threads", 1, "--directory", self.scans, "--compare",
                     self.json)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"(?m)^remesh/triangles:3000/threads:1 +\d")
        self.assertIn("only in the old: remesh/triangles:6000/threads:2", done.stdout)

    def test_a_batch_beside_a_loop(self):
        path = self.folder / "batch.json"
        done = bench("--sizes", "3000", "--threads", 2, "--batch", 3, "--repeats", 2,
                     "--directory", self.scans, "--json", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        document = json.loads(path.read_text())
        runs = {}
        for entry in document["benchmarks"]:
            if entry["run_type"] == "iteration":
                runs.setdefault(entry["run_name"], []).append(entry)
        batches = runs["batch/scans:3/triangles:3000/threads:2"]
        loops = runs.get("draco_encoder_loop/scans:3/triangles:3000", [])
        self.assertEqual(len(batches), 2)
        self.assertEqual(len(loops), 2 if shutil.which("draco_encoder") else 0)
        for batch in batches + loops:
            self.assertAlmostEqual(batch["scans_per_second"] * batch["real_time"], 3)
            self.assertAlmostEqual(batch["items_per_second"] * batch["real_time"], 9000, delta=90)
            self.assertAlmostEqual(batch["cpu_use"] * batch["real_time"], batch["cpu_time"])
        for batch, loop in zip(batches, loops):
            self.assertAlmostEqual(batch["times_draco_encoder"],
                                   batch["real_time"] / loop["real_time"])
        self.assertRegex(done.stdout, r"(?m)^batch of 3 scans of 3000 triangles, 2 threads")
        self.assertRegex(done.stdout, r"[\d.]+ scans/s, [\d.]+ % of 2 processors in use")
        self.assertEqual(len(list((self.scans / "batch_3x3000").glob("*.ply"))), 3)
        self.assertFalse((self.scans / "batch.out").exists())

    @unittest.skipUnless(KERNELS.exists(), "built without Google Benchmark")
    def test_kernels(self):
        path = self.folder / "kernels.json"
        done = subprocess.run([KERNELS, "--triangles=3000", "--benchmark_min_time=0.0001",
                               "--benchmark_out_format=json", f"--benchmark_out={path}"],
                              capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 0, done.stderr)
        document = json.loads(path.read_text())
        self.assertEqual(document["context"]["triangles"], "3000")
        self.assertEqual(document["context"]["rattan_commit"],
                         self.document["context"]["rattan_commit"])
        names = [b["name"].split("/")[0] for b in document["benchmarks"]]
        self.assertEqual(set(names), {"ingest", "exact_math", "store", "memory", "solve", "field",
                                      "param", "extract", "remesh"})
        for benchmark in document["benchmarks"]:
            self.assertNotIn("error_occurred", benchmark)
            self.assertGreater(benchmark["items_per_second"], 0)
        text = self.compare(document, document)
        self.assertIn(f"{len(names)} figures: 0 better, 0 worse", text)
        self.assertIn(" GiB, ", text)
        done = subprocess.run([KERNELS, "--colour"], capture_output=True)
        self.assertEqual(done.returncode, 2)

    def test_errors(self):
        text = self.folder / "text.json"
        text.write_text("{}")
        for words, code in ((["--sizes", "many"], 2), (["--repeats", "0"], 2), (["--colour"], 2),
                            (["--new", self.json], 2),
                            (["--compare", self.folder / "none.json"], 3),
                            (["--compare", text, "--new", self.json], 3)):
            with self.subTest(words=words):
                done = bench(*words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertTrue(done.stderr.startswith("rattan-bench: "), done.stderr)

    def test_the_folder_goes_when_it_was_its_own(self):
        space = self.folder / "tmp"
        space.mkdir()
        done = subprocess.run([BENCH, "--sizes", "3000", "--threads", "1"], capture_output=True,
                              env=dict(os.environ, TMPDIR=str(space)), timeout=100)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(list(space.iterdir()), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
