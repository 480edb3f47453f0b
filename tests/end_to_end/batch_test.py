# SPDX-License-Identifier: MIT
"""Many scans: every one is made once, whatever happens to the batch or to single runs, and what can
be made has the bytes of a single run."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "batch"))

import batch_checks as checks
from scan_samples import ascii_stl, binary_ply, obj, off, sphere, torus

RATTAN = os.environ["RATTAN"]
FACES = ("--faces", "60")


class Batch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.shared = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.large = cls.shared / "large.ply"
        subprocess.run([RATTAN, "synth", "-o", cls.large, "--triangles", "200000", "--quiet"],
                       check=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.shared, ignore_errors=True)

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.scans = self.folder / "scans"
        self.out = self.folder / "out"
        (self.scans / "sub").mkdir(parents=True)

    def add(self, name, data):
        (self.scans / name).write_bytes(data)

    def add_mixed(self):
        """Eight good scans and four broken ones."""
        for k in range(3):
            self.add(f"torus{k}.ply", binary_ply(torus(24 + 2 * k, 12)))
            self.add(f"sub/sphere{k}.obj", obj(sphere(10 + k)))
        self.add("sub/ball.off", off(sphere(14)))
        self.add("ball with 'blank.stl", ascii_stl(sphere(9)))
        self.add("empty.ply", b"")
        self.add("cut.ply", binary_ply(torus())[:-100])
        self.add("sub/prose.obj", b"Once upon a time\n")
        self.add("lie.off", b"OFF\n999999999999 999999999999 0\n0 0 0\n")
        return 8, 4

    def command(self, *options):
        return [str(w) for w in (RATTAN, "batch", self.scans, "-o", self.out, *options)]

    def batch(self, *options, code=0, env=None):
        done = subprocess.run(self.command(*options), capture_output=True, text=True, env=env,
                              timeout=checks.FAR_TOO_LONG)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def start(self, *options, env=None):
        return subprocess.Popen(self.command(*options), stderr=subprocess.PIPE, text=True, env=env,
                                start_new_session=True)

    def single(self, scan, *options):
        out = self.folder / "single.drc"
        subprocess.run([RATTAN, "remesh", str(scan), "-o", str(out), "--quiet", *options], check=True)
        return checks.digest(out)

    def wait_until(self, condition, seconds=60):
        until = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), until, "nothing happens")
            time.sleep(0.005)

    def running(self, batch):
        return checks.children_of(batch.pid)

    def test_mixed_scans(self):
        good, bad = self.add_mixed()
        said = self.batch(*FACES, code=3)
        made = checks.outputs(self.out)
        self.assertEqual(len(made), good)
        self.assertIn("sub/sphere1.drc", made)
        for name in ("torus0.ply", "sub/sphere2.obj", "ball with 'blank.stl"):
            self.assertEqual(made[str(Path(name).with_suffix(".drc"))],
                             self.single(self.scans / name, *FACES), name)
        exits = checks.last_exits(self.out)
        self.assertEqual(sorted(exits.values()), [0] * good + [3] * bad)
        for name in ("empty", "cut", "sub/prose", "lie"):
            log = (self.out / f"{name}.drc.log").read_text()
            self.assertIn(f"{self.scans / name}.", log)
            self.assertIn(" remesh ", log)
        self.assertIn("the file is empty", said)
        self.assertEqual(len(list(self.out.rglob("*.log"))), bad)
        self.assertEqual(checks.leftovers(self.out), [])
        # Nothing is left to do, and the code stays.
        before = list(checks.journal(self.out))
        self.batch(*FACES, code=3)
        self.assertEqual(checks.check_nothing_twice(self.out), (good + bad, good + bad, 0))
        self.assertEqual(len(list(checks.journal(self.out))), len(before) + 2)

    def test_changes_redo_what_they_affect(self):
        self.add("a.ply", binary_ply(torus()))
        self.add("b.obj", obj(sphere()))
        self.add("c.ply", b"")
        self.batch(*FACES, code=3)
        starts = lambda: {name: len(tries) for name, tries in checks.attempts(self.out).items()}
        self.assertEqual(starts(), {"a.drc": 1, "b.drc": 1, "c.drc": 1})
        self.batch(*FACES, "--threads", "1", "--memory", "900MiB", "--jobs", "1", code=3)
        self.assertEqual(starts(), {"a.drc": 1, "b.drc": 1, "c.drc": 1})
        self.add("b.obj", obj(sphere(11)))
        self.batch(*FACES, code=3)
        self.assertEqual(starts(), {"a.drc": 1, "b.drc": 2, "c.drc": 1})
        self.batch(*FACES, "--retry-failed", code=3)
        self.assertEqual(starts(), {"a.drc": 1, "b.drc": 2, "c.drc": 2})
        self.add("c.ply", binary_ply(sphere()))
        self.batch(*FACES)
        self.assertEqual(starts(), {"a.drc": 1, "b.drc": 2, "c.drc": 3})
        self.assertFalse((self.out / "c.drc.log").exists())
        (self.out / "a.drc").unlink()
        self.batch(*FACES)
        self.assertEqual(starts(), {"a.drc": 2, "b.drc": 2, "c.drc": 3})
        self.batch("--faces", "80")
        self.assertEqual(starts(), {"a.drc": 3, "b.drc": 3, "c.drc": 4})
        self.assertEqual(checks.outputs(self.out)["a.drc"],
                         self.single(self.scans / "a.ply", "--faces", "80"))

    def test_killed_and_run_again(self):
        good, bad = self.add_mixed()
        shutil.copy(self.large, self.scans / "large.ply")
        soon = dict(os.environ, RATTAN_CHECKPOINT_SECONDS="0")
        for number, alone in enumerate((True, False, True)):
            batch = self.start(*FACES, env=soon)
            self.wait_until(lambda: self.running(batch))
            time.sleep(0.1 + 0.15 * number)
            if alone:  # its children save their work
                os.kill(batch.pid, signal.SIGKILL)
            else:
                for child in self.running(batch):
                    try:
                        os.kill(child, signal.SIGKILL)
                    except ProcessLookupError:
                        pass
                os.killpg(batch.pid, signal.SIGKILL)
            batch.communicate()
        self.batch(*FACES, code=3)
        starts, ends, _ = checks.check_nothing_twice(self.out)
        self.assertGreaterEqual(starts, good + 1 + bad)
        self.assertLessEqual(ends, starts)
        made = checks.outputs(self.out)
        self.assertEqual(len(made), good + 1)
        self.assertEqual(made["large.drc"], self.single(self.large, *FACES))
        self.assertEqual(checks.leftovers(self.out), [])

    def test_interrupted(self):
        shutil.copy(self.large, self.scans / "large.ply")
        shutil.copy(self.large, self.scans / "other.ply")
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
            batch = self.start(*FACES)
            self.wait_until(lambda: self.running(batch))
            time.sleep(0.3)
            began = time.monotonic()
            os.kill(batch.pid, number)
            said = batch.communicate(timeout=30)[1]
            self.assertEqual(batch.returncode, 75, said)
            self.assertLess(time.monotonic() - began, 10.0)
            shutil.rmtree(self.out)
        batch = self.start(*FACES)
        self.wait_until(lambda: self.running(batch))
        time.sleep(0.3)
        os.kill(batch.pid, signal.SIGTERM)
        batch.communicate()
        self.batch(*FACES)
        checks.check_nothing_twice(self.out)
        self.assertEqual(set(checks.last_exits(self.out).values()), {0})

    def test_runs_that_are_shot(self):
        for name in ("a", "b", "c", "d"):
            shutil.copy(self.large, self.scans / f"{name}.ply")
        batch = self.start(*FACES, "--threads", "2")
        shots = {}

        def shoot():
            for child in self.running(batch):
                try:
                    words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
                except OSError:
                    continue
                name = Path(words[2].decode()).stem if len(words) > 2 else ""
                if name in ("a", "b") and name not in shots:
                    shots[name] = child
                    time.sleep(0.05)
                    os.kill(child, signal.SIGKILL if name == "a" else signal.SIGSEGV)
            return len(shots) == 2
        self.wait_until(shoot)
        said = batch.communicate(timeout=checks.FAR_TOO_LONG)[1]
        self.assertEqual(batch.returncode, 1, said)
        exits = checks.last_exits(self.out)
        self.assertEqual(exits, {"a.drc": 4, "b.drc": 1, "c.drc": 0, "d.drc": 0})
        self.assertIn("want of memory", said)
        self.assertIn("Segmentation fault", said)
        # What was killed is made by the next run, what crashed when asked for.
        self.batch(*FACES, code=1)
        self.assertEqual(checks.last_exits(self.out)["a.drc"], 0)
        self.batch(*FACES, "--retry-failed")
        self.assertEqual(len(set(checks.outputs(self.out).values())), 1)

    def test_two_at_once(self):
        good, bad = self.add_mixed()
        batches = [self.start(*FACES), self.start(*FACES)]
        for batch in batches:
            said = batch.communicate(timeout=checks.FAR_TOO_LONG)[1]
            self.assertEqual(batch.returncode, 3, said)
        starts, ends, _ = checks.check_nothing_twice(self.out)
        self.assertEqual((starts, ends), (good + bad, good + bad))
        self.assertEqual(len(checks.outputs(self.out)), good)
        self.assertEqual(checks.leftovers(self.out), [])

    def test_too_little_memory_for_one(self):
        self.add("small.ply", binary_ply(torus()))
        shutil.copy(self.large, self.scans / "large.ply")
        self.batch("--ratio", "5", "--memory", "300MiB", code=4)
        self.assertEqual(checks.last_exits(self.out), {"large.drc": 4, "small.drc": 0})
        self.assertIn("--memory", (self.out / "large.drc.log").read_text())
        self.batch("--ratio", "0.01", "--memory", "300MiB")

    def test_status(self):
        good, bad = self.add_mixed()
        status = lambda *o: subprocess.run([RATTAN, "batch", "--status", str(self.out), *o],
                                           capture_output=True, text=True)
        self.assertEqual(status().returncode, 3)
        shutil.copy(self.large, self.scans / "large.ply")
        import json
        batch = self.start("--faces", "200", "--threads", "1")
        self.wait_until(lambda: self.running(batch))
        self.wait_until(lambda: json.loads(status("--json").stdout or "{}").get("running"))
        now = json.loads(status("--json").stdout)
        self.assertEqual(now["items"], good + bad + 1)
        self.assertEqual(now["processes"], 1)
        self.assertEqual(now["running"][0]["pid"], batch.pid)
        batch.communicate(timeout=checks.FAR_TOO_LONG)
        then = json.loads(status("--json").stdout)
        self.assertEqual((then["done"], then["failed"], then["pending"], then["running"]),
                         (good + 1, bad, 0, []))
        self.assertIn(f"{good + 1} done, {bad} failed", status().stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
