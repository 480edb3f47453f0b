# SPDX-License-Identifier: MIT
"""A batch on Slurm: over the nodes of a cluster, through interruptions, to the merge."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from slurm_cluster import Cluster, why_not

RATTAN = os.environ["RATTAN"]
REASON = why_not()
if REASON:
    print(f"skipped: {REASON}", file=sys.stderr)


def journal(directory):
    records = []
    for file in sorted((directory / ".rattan" / "journal").glob("*.jsonl")):
        for line in file.read_text().splitlines():
            try:
                records.append(json.loads(line))
            except json.JSONDecodeError:
                pass  # the last line of a process that was killed
    return sorted(records, key=lambda r: r["time"])


@unittest.skipIf(REASON, REASON)
class SlurmBatch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.shared = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.addClassCleanup(shutil.rmtree, cls.shared, ignore_errors=True)
        cls.cluster = Cluster()
        cls.addClassCleanup(cls.cluster.stop)
        cls.scans = cls.shared / "scans"
        (cls.scans / "more").mkdir(parents=True)
        cls.names = []
        for k in range(9):
            name = f"{'more/' if k % 3 == 0 else ''}scan {k}"
            subprocess.run([RATTAN, "synth", "-o", cls.scans / f"{name}.ply", "--triangles",
                            str(3000 + 2000 * k), "--seed", str(k + 1), "--quiet"], check=True)
            cls.names.append(name)
        (cls.scans / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex many\n")

    def setUp(self):
        # A name that a careless script would trip over.
        self.root = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        self.directory = self.root / "it's \"50%A\" $HOME\nout"

    def tearDown(self):
        queue = {task.split("_")[0] for task in self.cluster.queue()}
        if queue:
            self.cluster.run("scancel", *queue)
            self.cluster.wait_until_empty()

    def submit(self, *options, scans=None, code=0):
        return self.cluster.run(RATTAN, "slurm", scans or self.scans, "-o", self.directory,
                                "--cpus-per-task", "2", "--mem", "900", *options, code=code)

    @staticmethod
    def jobs(said):
        return {name: job for job, name in re.findall(r"^job (\d+): (\S+)$", said, re.M)}

    def log(self, name):
        return (self.directory / ".rattan" / "slurm" / "logs" / name).read_text()

    def ends(self, code=0):
        return [r["id"] for r in journal(self.directory) if r["event"] == "end" and
                r["exit"] == code]

    def check_outputs(self, names, *options):
        for name in names:
            single = self.root / "single.drc"
            subprocess.run([RATTAN, "remesh", self.scans / f"{name}.ply", "-o", single, "--quiet",
                            *options], check=True)
            self.assertEqual((self.directory / f"{name}.drc").read_bytes(), single.read_bytes(),
                             name)

    def test_a_batch_over_three_nodes_and_the_merge(self):
        said = self.submit("--tasks", "3")
        self.assertIn("10 scans: 0 done, 0 failed, 0 with earlier tasks, 10 to do", said)
        jobs = self.jobs(said)
        again = self.submit("--tasks", "3")  # while they are in the queue
        self.assertRegex(again, r"10 scans: \d+ done, \d failed, \d+ with earlier tasks, 0 to do")
        self.cluster.wait_until_empty()

        self.check_outputs(self.names)
        self.assertEqual(sorted(self.ends()), sorted(f"{n}.drc" for n in self.names))
        self.assertEqual(self.ends(3), ["broken.drc"])
        starts = [r for r in journal(self.directory) if r["event"] == "start"]
        self.assertEqual({r["host"] for r in starts}, {"n1", "n2", "n3"})
        self.assertEqual({r["slurm"] for r in starts},
                         {f"{jobs['scans']}_{k}" for k in (1, 2, 3)})
        for record in starts:
            self.assertLessEqual(record["threads"], 2)
            self.assertLessEqual(record["memory"], 900 << 20)
        self.assertEqual(sorted(self.cluster.field(jobs["scans"], "ExitCode")),
                         ["0:0", "0:0", "3:0"])
        self.assertEqual(self.cluster.field(jobs["merge"], "ExitCode"), ["0:0"])
        report = json.loads((self.directory / "report.json").read_text())
        self.assertEqual(report["totals"]["done"], 9)
        self.assertEqual(report["totals"]["unusable"], 1)
        self.assertIn("none is missing", self.log(f"merge_{jobs['merge']}.log"))
        self.assertIn("0 to do", self.submit())

    def test_an_interrupted_task_is_requeued_and_the_merge_waits(self):
        big = self.root / "big.ply"
        # Several seconds of work on its one processor: the signal comes within the first.
        subprocess.run([RATTAN, "synth", "-o", big, "--triangles", "2000000", "--quiet"],
                       check=True)
        small = self.scans / f"{self.names[1]}.ply"
        said = self.cluster.run(RATTAN, "slurm", big, small, "-o", self.directory, "--tasks", "2",
                                "--name", "{stem}", "--cpus-per-task", "1", "--mem", "1500")
        jobs = self.jobs(said)
        started = lambda: [r for r in journal(self.directory) if r["event"] == "start" and
                           r["id"] == "big.drc"]
        self.cluster.wait("the start of the big scan", started)
        task = started()[0]["slurm"]
        # As the warning before a time limit, or a user who wants the node for something else.
        self.cluster.run("scancel", "--signal=USR1", "--batch", task)
        self.cluster.wait("the requeue", lambda: "asks for another turn" in
                          self.log(f"{task}.log"), 30)
        self.cluster.wait("the requeued task", lambda: self.cluster.queue().get(task) != "RUNNING")
        self.assertEqual(self.cluster.queue().get(jobs["merge"]), "PENDING")
        self.assertFalse((self.directory / "big.drc").exists())
        self.cluster.wait_until_empty()

        records = [r for r in journal(self.directory) if r.get("id") == "big.drc"]
        self.assertEqual([r["exit"] for r in records if r["event"] == "end"], [75, 0])
        self.assertEqual(sorted(self.ends()), ["big.drc", f"{Path(self.names[1]).name}.drc"])
        single = self.root / "single.drc"
        subprocess.run([RATTAN, "remesh", big, "-o", single, "--quiet"], check=True)
        self.assertEqual((self.directory / "big.drc").read_bytes(), single.read_bytes())
        merged = json.loads((self.directory / "report.json").read_text())
        self.assertEqual(merged["totals"]["done"], 2)

    def test_the_merge_names_what_a_cancelled_task_left_and_the_command_submits_it(self):
        said = self.submit("--tasks", "5", "--nodes-at-once", "1", "--ratio", "0.1")
        jobs = self.jobs(said)
        self.cluster.run("scancel", f"{jobs['scans']}_[4-5]")
        self.cluster.wait_until_empty()
        self.assertEqual(self.cluster.field(jobs["merge"], "ExitCode"), ["75:0"])
        log = self.log(f"merge_{jobs['merge']}.log")
        left = int(re.search(r"(\d+) of 10 scans are neither done nor failed", log)[1])
        self.assertGreater(left, 1)
        self.assertTrue((self.directory / "report.json").exists())
        before = self.ends()
        # The command as the log has it.
        command = log[log.index("submits what is missing:\n") + 25:]
        done = self.cluster.run("bash", "-c", command)
        self.assertIn(f"{left} to do", done)
        self.cluster.wait_until_empty()
        self.assertEqual(len(self.ends()), 9)
        self.assertEqual(self.ends()[:len(before)], before)
        self.check_outputs(self.names[:3], "--ratio", "0.1")

    def test_what_is_impossible_is_said_at_once(self):
        for options, words in ((("--cpus-per-task", "99"), "largest have 4 processors"),
                               (("--mem", "1T"), "largest have 4 processors and 4000 MiB"),
                               (("--partition", "nowhere"), "there are batch, urgent"),
                               (("--time", "soon"), "--time soon"),
                               (("--account", "a b"), "--account a b")):
            done = subprocess.run([RATTAN, "slurm", self.scans, "-o", self.directory, *options],
                                  env=self.cluster.environment, capture_output=True, text=True,
                                  timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(words, done.stderr)
        self.assertEqual(self.cluster.queue(), {})


class WithoutSlurm(unittest.TestCase):
    def test_scripts_are_written_where_there_is_no_slurm(self):
        root = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, root, ignore_errors=True)
        (root / "scan.ply").write_text("ply\n")
        command = [RATTAN, "slurm", root / "scan.ply", "-o", root / "out"]
        environment = dict(os.environ, PATH=str(root))
        refused = subprocess.run(command, env=environment, capture_output=True, text=True)
        self.assertEqual(refused.returncode, 2, refused.stderr)
        self.assertIn("--no-submit", refused.stderr)
        done = subprocess.run([*command, "--no-submit"], env=environment, capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        folder = root / "out" / ".rattan" / "slurm" / "1"
        self.assertEqual(sorted(p.name for p in folder.iterdir()),
                         ["merge.sh", "plan.json", "scans.jsonl", "scans.sh", "submit.sh"])
        self.assertIn(str(folder / "submit.sh"), done.stdout)


if __name__ == "__main__":
    unittest.main()
