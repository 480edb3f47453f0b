# SPDX-License-Identifier: MIT
"""Nothing is lost: a run that is killed, interrupted, out of disk or finds its work damaged goes on
when the same command is given again, and ends with the bytes of an undisturbed run."""

import fnmatch
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
SOONEST = dict(os.environ, RATTAN_CHECKPOINT_SECONDS="0")  # a checkpoint after every step
# What may differ between a run and one that was resumed.
OF_THE_RUN = {"stages", "seconds", "peak_rss_bytes", "memory_budget_bytes", "work", "warnings"}


def names_in(folder):
    """What a folder holds; nothing if the program has just removed it."""
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return []


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


class Resume(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.shared = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.scan = cls.shared / "scan.ply"
        subprocess.run([RATTAN, "synth", "-o", cls.scan, "--triangles", "150000", "--genus", "2",
                        "--holes", "2", "--quiet"], check=True)
        cls.expected = {}

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.shared, ignore_errors=True)

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.work = self.folder / "out.obj.work"
        self.out = self.folder / "out.obj"

    def command(self, *options, folder=None, scan=None):
        folder = folder or self.folder
        return [str(w) for w in (RATTAN, "remesh", scan or self.scan, "-o", folder / "out.obj",
                                 "--quiet", "--report", folder / "report.json", *options)]

    def start(self, *options, env=SOONEST, **more):
        return subprocess.Popen(self.command(*options, **more), stderr=subprocess.PIPE, text=True,
                                env=env)

    def run_whole(self, *options, env=SOONEST, code=0, **more):
        done = subprocess.run(self.command(*options, **more), capture_output=True, text=True,
                              env=env, timeout=300)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def undisturbed(self, *options):
        """Digest, report and seconds of a run without checkpoints."""
        key = " ".join(map(str, options))
        if key not in self.expected:
            folder = self.shared / f"expected{len(self.expected)}"
            folder.mkdir()
            begin = time.monotonic()
            self.run_whole(*options, env=os.environ, folder=folder)
            self.assertEqual(sorted(p.name for p in folder.iterdir()), ["out.obj", "report.json"])
            self.expected[key] = (digest(folder / "out.obj"),
                                  json.loads((folder / "report.json").read_text()),
                                  time.monotonic() - begin)
        return self.expected[key]

    def report(self):
        return json.loads((self.folder / "report.json").read_text())

    def resumed_stages(self):
        return [s["name"] for s in self.report()["stages"] if s["resumed"]]

    def check_finished(self, *options):
        expected, report, _ = self.undisturbed(*options)
        self.assertEqual(digest(self.out), expected)
        self.assertFalse(self.work.exists())
        mine = self.report()
        for name in set(report) - OF_THE_RUN:
            if name in ("options", "output", "outputs"):
                continue  # paths
            for figures in (mine, report):
                if name == "input":
                    figures[name]["path"] = ""
            self.assertEqual(mine[name], report[name], name)
        self.assertEqual([{**o, "path": ""} for o in mine["outputs"]],
                         [{**o, "path": ""} for o in report["outputs"]])
        names = {s["name"] for s in report["stages"]}
        self.assertEqual({s["name"] for s in mine["stages"]}, names)

    def wait_for(self, path, process):
        while not path.exists():
            self.assertIsNone(process.poll(), "ended too early")
            time.sleep(0.005)

    def kill_in(self, pattern, *options, sent=signal.SIGKILL, **more):
        """Ends a run once a file of the pattern is there."""
        process = self.start(*options, **more)
        while not (fnmatch.filter(names := names_in(self.work), pattern) and "checkpoint" in names):
            self.assertIsNone(process.poll(), "ended too early")
            time.sleep(0.002)
        process.send_signal(sent)
        errors = process.communicate(timeout=60)[1]
        return process.returncode, errors

    def test_kills_at_random_instants(self):
        dice = random.Random(4)
        seconds = self.undisturbed()[2]
        kills = 0
        for _ in range(3):
            while True:
                process = self.start()
                try:
                    errors = process.communicate(timeout=dice.uniform(0.05, 1.2 * seconds))[1]
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
                    kills += 1
            self.assertEqual(process.returncode, 0, errors)
            self.check_finished()
            self.out.unlink()
        self.assertGreater(kills, 0)

    def test_what_was_done_is_not_done_again(self):
        self.kill_in("param.*.h5")
        self.assertFalse(self.out.exists())
        self.run_whole()
        self.check_finished()
        self.assertEqual(self.resumed_stages()[:2], ["ingest", "field"])
        field = [s for s in self.report()["stages"] if s["name"] == "field"]
        self.assertEqual([s["resumed"] for s in field], [True])
        self.assertGreater(field[0]["passes"], 0)

    def test_short_runs_write_nothing(self):
        process = self.start(env=os.environ)
        seen = set()
        while process.poll() is None:
            seen.update(names_in(self.work))
            time.sleep(0.005)
        process.communicate()
        if self.undisturbed()[2] < 4:
            self.assertEqual({n for n in seen if not n.startswith("lock.")}, set())

    def test_signals(self):
        for sent in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
            with self.subTest(signal=sent):
                process = self.start(env=os.environ)
                self.wait_for(self.work, process)
                time.sleep(0.5 * self.undisturbed()[2])
                begin = time.monotonic()
                process.send_signal(sent)
                errors = process.communicate(timeout=60)[1]
                self.assertLess(time.monotonic() - begin, 10)
                if process.returncode == 0:
                    continue  # the machine is fast
                self.assertEqual(process.returncode, 75, errors)
                self.assertIn("Interrupted", errors)
                self.assertIn("run the same command again to resume", errors)
                self.assertFalse(self.out.exists())
                self.run_whole(env=os.environ)
                self.check_finished()
                if (self.work / "checkpoint").exists():
                    self.assertIn("ingest", self.resumed_stages())
                self.out.unlink()

    def test_one_request_to_stop_may_be_two_signals(self):
        process = self.start()
        self.wait_for(self.work, process)
        time.sleep(0.2)
        process.send_signal(signal.SIGTERM)
        time.sleep(0.05)
        process.send_signal(signal.SIGUSR1)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 75, errors)
        self.run_whole()
        self.assertIn("ingest", self.resumed_stages())  # the work was saved
        self.check_finished()

    def test_a_later_signal_ends_at_once(self):
        process = self.start(env=os.environ)
        self.wait_for(self.work, process)
        time.sleep(0.2)
        process.send_signal(signal.SIGTERM)
        time.sleep(2.1)
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        begin = time.monotonic()
        process.communicate(timeout=60)
        self.assertLess(time.monotonic() - begin, 1)
        self.assertEqual(process.returncode, 75)
        self.run_whole()
        self.check_finished()

    def test_changed_options_and_scans(self):
        cases = [(("--crease", "off"), ["ingest"]),
                 (("--faces", "2000"), ["ingest"]),
                 (("--newton-steps", "1"), ["ingest", "field"]),
                 (("--density", "2"), ["ingest", "field"])]
        for options, kept in cases:
            with self.subTest(options=options):
                self.kill_in("remesh.*.h5")
                self.run_whole(*options)
                self.check_finished(*options)
                self.assertEqual(self.resumed_stages(), kept)
                self.out.unlink()
        with self.subTest("another thread count and budget change nothing"):
            self.kill_in("remesh.*.h5", "--threads", "2")
            self.run_whole("--threads", "1", "--memory", "512MiB")
            self.assertEqual(digest(self.out), self.undisturbed()[0])
            self.assertIn("parameterize", self.resumed_stages())
            self.out.unlink()
        with self.subTest("fresh"):
            self.kill_in("remesh.*.h5")
            self.run_whole("--fresh")
            self.check_finished()
            self.assertEqual(self.resumed_stages(), [])
            self.out.unlink()
        with self.subTest("another scan under the same name"):
            scan = self.folder / "scan.ply"
            shutil.copy(self.scan, scan)
            self.kill_in("remesh.*.h5", scan=scan)
            before = scan.stat()
            copy = bytearray(scan.read_bytes())
            at = copy.index(b"end_header\n") + len(b"end_header\n")
            copy[at:at + 8] = copy[at + 12:at + 20]
            scan.write_bytes(copy)
            os.utime(scan, ns=(before.st_atime_ns, before.st_mtime_ns))
            self.run_whole(scan=scan)
            self.assertEqual(self.resumed_stages(), [])
            self.out.unlink()
        with self.subTest("a scan that was copied is the same scan"):
            shutil.copy(self.scan, scan)
            self.kill_in("remesh.*.h5", scan=scan)
            scan.unlink()
            shutil.copy(self.scan, scan)
            self.run_whole(scan=scan)
            self.check_finished()
            self.assertIn("ingest", self.resumed_stages())

    def test_kept_work(self):
        self.run_whole("--keep-work")
        self.assertTrue((self.work / "checkpoint").exists())
        self.assertEqual(list(self.work.glob("*.partial")), [])
        first = digest(self.out)
        self.assertEqual(first, self.undisturbed()[0])
        subprocess.run([RATTAN, "info", self.work], check=True, capture_output=True)
        self.run_whole("--keep-work")
        self.assertTrue(all(s["resumed"] for s in self.report()["stages"]))
        self.out.write_text("something else")  # is no longer what the run wrote
        self.run_whole()
        self.assertEqual(digest(self.out), first)
        self.assertFalse(self.work.exists())

    def test_several_sizes(self):
        options = ("--faces", "3000,1500,400")
        names = [self.folder / f"out{n}.obj" for n in (3000, 1500, 400)]

        def start(env):
            return subprocess.Popen(
                [RATTAN, "remesh", self.scan, "-o", self.folder / "out{faces}.obj", "--quiet",
                 *options], env=env, stderr=subprocess.PIPE, text=True)
        process = start(os.environ)
        self.assertEqual(process.communicate()[1], "")
        expected = [digest(n) for n in names]
        for n in names:
            n.unlink()
        for last in names[:2]:  # killed once this one is there; then it is removed, too
            process = start(SOONEST)
            self.wait_for(last, process)
            process.kill()
            process.communicate()
            last.unlink()
        process = start(SOONEST)
        process.communicate()
        self.assertEqual(process.returncode, 0)
        self.assertEqual([digest(n) for n in names], expected)
        self.assertEqual([p.name for p in self.folder.glob("*.work")], [])

    def test_two_processes(self):
        process = self.start()
        self.wait_for(self.work / "lock.1", process)
        time.sleep(0.2)
        second = subprocess.run(self.command(), capture_output=True, text=True, timeout=30)
        if process.poll() is None:
            self.assertEqual(second.returncode, 4, second.stderr)
            self.assertIn(str(self.work), second.stderr)
            self.assertIn(f"process {process.pid} on {os.uname().nodename}", second.stderr)
        errors = process.communicate()[1]
        self.assertEqual(process.returncode, 0, errors)
        self.check_finished()

    def test_damaged_files(self):
        for how in ("flip", "cut", "swap", "none", "record"):
            with self.subTest(how=how):
                self.kill_in("remesh.*.h5")
                files = sorted(self.work.glob("*.h5"))
                victim = next(f for f in files if f.name.startswith("graph."))
                data = bytearray(victim.read_bytes())
                if how == "flip":
                    for at in range(len(data) // 4, len(data), 997):
                        data[at] ^= 1
                    victim.write_bytes(data)
                elif how == "cut":
                    victim.write_bytes(data[:len(data) // 2])
                elif how == "swap":
                    other = next(f for f in files if f.name.startswith("mesh."))
                    shutil.copy(other, victim)
                elif how == "none":
                    victim.unlink()
                else:
                    victim = self.work / "checkpoint"
                    data = bytearray(victim.read_bytes())
                    data[len(data) // 2] ^= 1
                    victim.write_bytes(data)
                errors = self.run_whole()
                self.assertIn(victim.name, errors)
                self.assertIn("warning", errors)
                self.check_finished()
                self.out.unlink()

    def test_full_disk(self):
        if os.geteuid() != 0:
            self.skipTest("only root mounts a small file system")
        disk = self.folder / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=14M", "tmpfs", disk],
                          capture_output=True).returncode != 0:
            self.skipTest("nothing can be mounted here")
        try:
            errors = self.run_whole("--work-dir", disk / "work", code=4)
            self.assertIn("are needed", errors)
            self.assertIn("--work-dir", errors)
            self.assertFalse(self.out.exists())
            subprocess.run(["mount", "-o", "remount,size=200M", disk], check=True)
            self.run_whole("--work-dir", disk / "work")
            self.assertIn("ingest", self.resumed_stages())
            self.assertEqual(digest(self.out), self.undisturbed()[0])
            self.assertEqual(list(disk.iterdir()), [])
        finally:
            subprocess.run(["umount", "-l", disk], check=True)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])
