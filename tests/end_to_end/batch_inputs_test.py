# SPDX-License-Identifier: MIT
"""What `rattan batch` takes for its scans, under which names it writes, and what it refuses before
anything runs. The outputs are those of single runs, byte for byte."""

import csv
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

from scan_samples import binary_ply, moved, obj, off, torus

RATTAN = os.environ["RATTAN"]


def rattan(*words, cwd=None):
    return subprocess.run([RATTAN, *map(os.fspath, words)], cwd=cwd, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=600)


class BatchInputs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="rattan_inputs_")
        self.addCleanup(folder.cleanup)
        self.at = Path(folder.name)

    def scan(self, name, stretch=1.0):
        """A small torus, another for each stretch."""
        path = self.at / name
        path.parent.mkdir(parents=True, exist_ok=True)
        mesh = moved(torus(20, 12), (1.0, 1.0, stretch))
        kind = os.fsdecode(name).rsplit(".", 1)[-1].lower()
        path.write_bytes({"obj": obj, "off": off}.get(kind, binary_ply)(mesh))
        return path

    def batch(self, *words, code=0):
        done = rattan("batch", *words, "--no-report", cwd=self.at)
        self.assertEqual(done.returncode, code, done.stderr.decode(errors="replace"))
        return done

    def refused(self, *words):
        """What was said; nothing may have been made."""
        before = sorted(self.at.rglob("*"))
        done = self.batch(*words, code=2)
        self.assertEqual(sorted(self.at.rglob("*")), before)
        lines = done.stderr.decode().splitlines()
        self.assertTrue(lines and lines[-1].startswith("rattan: ") or "See rattan --help" in lines[-1],
                        lines)
        return " ".join(lines)

    def outputs(self, folder="out"):
        root = self.at / folder
        return sorted(os.fspath(p.relative_to(root)) for p in root.rglob("*")
                      if p.suffix in (".drc", ".obj", ".ply", ".off") and p.is_file())

    def ends(self, folder="out"):
        """(id, exit) of every attempt that ended."""
        events = []
        for journal in sorted((self.at / folder / ".rattan" / "journal").iterdir()):
            events += [json.loads(line) for line in journal.read_text().splitlines()]
        return [(e["id"], e["exit"]) for e in events if e["event"] == "end"]

    def assert_as_single(self, scan, output, *words):
        single = self.at / "single" / Path(output).name
        single.parent.mkdir(exist_ok=True)
        done = rattan("remesh", scan, "-o", single, *words, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.at / output).read_bytes(), single.read_bytes())

    def test_folder(self):
        a = self.scan("scans/a.ply")
        b = self.scan("scans/rome/b.OBJ", 1.2)
        self.scan("scans/.hidden.ply")
        (self.at / "scans/notes.txt").write_text("no scan")
        (self.at / "scans/rome/up").symlink_to("..")
        self.batch("scans", "-o", "out", "--faces", "60")
        self.assertEqual(self.outputs(), ["a.drc", "rome/b.drc"])
        self.assert_as_single(a, "out/a.drc", "--faces", "60")
        self.assert_as_single(b, "out/rome/b.drc", "--faces", "60")
        # Once more: nothing to do. One more size: all of it.
        self.batch("scans", "-o", "out", "--faces", "60")
        self.assertEqual(len(self.ends()), 2)
        self.batch("scans", "-o", "out", "--faces", "60,30")
        self.assertEqual(self.outputs(), ["a-30.drc", "a-60.drc", "a.drc", "rome/b-30.drc",
                                          "rome/b-60.drc", "rome/b.drc"])

    def test_outputs_inside_the_folder(self):
        self.scan("scans/a.ply")
        for _ in range(2):
            self.batch("scans", "-o", "scans/out", "--faces", "60", "--format", "ply")
            self.assertEqual(self.outputs("scans/out"), ["a.ply"])
        self.assertEqual(self.ends("scans/out"), [("a.ply", 0)])

    def test_odd_names(self):
        names = ["-dash.ply", "sp ace.ply", "quo\"te's.ply", "new\nline.ply", "\u00e9\u6f22.ply", "a{n}.ply",
                 "per%cent.ply", "two.dots.ply", "back\\slash.ply"]
        for k, name in enumerate(names):
            self.scan("scans/" + name, 1.0 + 0.01 * k)
        self.scan(Path(os.fsdecode(b"scans/latin\xe9.ply")), 1.3)
        want = sorted(n[:-4] + ".drc" for n in names + [os.fsdecode(b"latin\xe9.ply")])
        self.batch("scans", "-o", "out", "--faces", "60")
        self.assertEqual(self.outputs(), want)
        for manifest in ("m.csv", "m.jsonl"):
            self.batch("scans", "-o", "out", "--faces", "60", "--write-manifest", manifest)
            self.batch(manifest, "-o", "out")
            self.assertEqual(len(self.ends()), len(want), "the manifest asks for something else")

    def test_manifest(self):
        a, b, c = (self.scan(f"scans/{n}.ply", 1 + k / 9) for k, n in enumerate("abc"))
        (self.at / "m.csv").write_bytes(
            b"\xef\xbb\xbfpath,output,faces,pure-quads,crease\r\n"
            b"scans/a.ply,x/first.obj,\"60,40\",,\r\n"
            b"\r\n"
            b"scans/b.ply,,,yes,off\r\n"
            b"scans/gone.ply,,,,\r\n")
        done = self.batch("m.csv", "scans", "-o", "out", "--faces", "50", code=3)
        self.assertEqual(self.outputs(), ["c.drc", "scans/b.drc", "x/first-40.obj", "x/first-60.obj"])
        self.assert_as_single(b, "out/scans/b.drc", "--faces", "50", "--pure-quads", "--crease=off")
        self.assert_as_single(c, "out/c.drc", "--faces", "50")
        self.assertIn(("scans/gone.drc", 3), self.ends())
        self.assertNotIn(b"defect", done.stderr)
        # Rows that change are done again, and no other.
        before = self.ends()
        text = (self.at / "m.csv").read_text().replace("yes,off", "no,off")
        (self.at / "m.csv").write_text(text)
        self.batch("m.csv", "scans", "-o", "out", "--faces", "50", code=3)
        self.assertEqual(sorted(set(self.ends()[:]) - set(before)), [])
        self.assertEqual(len(self.ends()), len(before) + 1)
        self.assert_as_single(b, "out/scans/b.drc", "--faces", "50", "--crease=off")

    def test_json_lines(self):
        self.scan("a.ply")
        (self.at / "m.jsonl").write_text(
            '{"path": "a.ply", "faces": [60, "0.04k"], "memory": "1GiB", "threads": 1}\n'
            '{"path": "a.ply", "output": "ratio/a.off", "ratio": 0.2, "crease": "off"}\n')
        self.batch("m.jsonl", "-o", "out")
        self.assertEqual(self.outputs(), ["a-40.drc", "a-60.drc", "ratio/a.off"])
        self.assert_as_single(self.at / "a.ply", "out/ratio/a.off", "--ratio", "0.2", "--crease=off")

    def test_written_manifest(self):
        self.scan("scans/a.ply")
        self.scan("scans/b/c.ply", 1.1)
        for name in ("m.csv", "m.jsonl"):
            self.batch("scans", "--write-manifest", name, "--faces", "60", "--pure-quads",
                       "--name", "{root}-{stem}", "--format", "obj")
        self.assertFalse((self.at / "out").exists())
        rows = list(csv.DictReader((self.at / "m.csv").open(newline="")))
        lines = [json.loads(line) for line in (self.at / "m.jsonl").read_text().splitlines()]
        self.assertEqual([r["path"] for r in rows], [os.fspath(self.at / "scans/a.ply"),
                                                     os.fspath(self.at / "scans/b/c.ply")])
        self.assertEqual([r["output"] for r in rows], ["scans-a.obj", "scans-c.obj"])
        self.assertEqual([r["path"] for r in lines], [r["path"] for r in rows])
        self.assertEqual([float(r["cost"]) for r in rows], [r["cost"] for r in lines])
        self.assertGreater(lines[0]["cost"], 0)
        self.assertEqual(lines[0]["faces"], 60)
        self.assertIs(lines[0]["pure-quads"], True)
        self.batch("m.csv", "-o", "out")
        self.batch("m.jsonl", "-o", "out")
        self.batch("scans", "-o", "out", "--faces", "60", "--pure-quads", "--name", "{root}-{stem}",
                   "--format", "obj")
        self.assertEqual(sorted(self.ends()), [("scans-a.obj", 0), ("scans-c.obj", 0)])

    def test_shards(self):
        names = [f"s{k}.ply" for k in range(5)]
        for k, name in enumerate(names):
            self.scan("scans/" + name, 1 + 0.1 * k)
        seen = []
        for part in (1, 2, 3):
            self.batch("scans", "-o", f"out{part}", "--faces", "60", "--shard", f"{part}/3")
            seen += self.outputs(f"out{part}")
        self.assertEqual(sorted(seen), sorted(n[:-4] + ".drc" for n in names))
        self.batch("scans", "-o", "none", "--faces", "60", "--shard", "7/7")
        self.assertEqual(self.outputs("none") if (self.at / "none").exists() else [], [])

    def test_unusable_files_stop_nothing(self):
        self.scan("scans/a.ply")
        (self.at / "scans/broken.ply").write_bytes(b"ply\nformat")
        (self.at / "scans/empty.stl").write_bytes(b"")
        (self.at / "scans/nowhere.obj").symlink_to("missing")
        done = self.batch("scans", "gone.ply", "-o", "out", "--faces", "60", code=3)
        self.assertEqual(self.outputs(), ["a.drc"])
        self.assertEqual(sorted(self.ends()), [("a.drc", 0), ("broken.drc", 3), ("empty.drc", 3),
                                               ("gone.drc", 3), ("nowhere.drc", 3)])
        for name in ("broken.ply", "empty.stl", "nowhere.obj", "gone.ply"):
            self.assertIn(name.encode(), done.stdout + done.stderr)

    def test_dry_run_makes_nothing(self):
        self.scan("scans/a.ply")
        self.scan("scans/b/c.ply")
        before = sorted(self.at.rglob("*"))
        text = self.batch("scans", "-o", "out", "--faces", "60", "--dry-run", "--threads", "2",
                          "--memory", "1GiB").stdout.decode()
        self.assertEqual(sorted(self.at.rglob("*")), before)
        for part in ("scans/a.ply -> a.drc", "scans/b/c.ply -> b/c.drc", "2 scans to do of 2",
                     " 480 ", " 60 ", "2 threads and 1.0 GiB"):
            self.assertIn(part, text)
        self.batch("scans", "-o", "out", "--faces", "60", "--shard", "1/2")
        text = self.batch("scans", "-o", "out", "--faces", "60", "--dry-run").stdout.decode()
        self.assertIn("1 scan to do of 2", text)
        self.batch("scans", "-o", "out2", "--dry-run", "--memory", "1MiB", code=4)

    def test_refusals(self):
        self.scan("scans/a.ply")
        self.scan("scans/a.obj")
        self.scan("more/a.ply")
        (self.at / "empty").mkdir()
        (self.at / "file").write_text("")
        manifests = {
            "typo.csv": "path,face\nscans/a.ply,5\n",
            "value.csv": "path,symmetry\nscans/a.ply,2\nscans/a.ply,3\n",
            "twice.csv": "path,faces\nscans/a.ply,5\nscans/a.ply,6\n",
            "out.csv": "path,output\nscans/a.ply,../a.drc\n",
            "bad.jsonl": '{"path": "scans/a.ply"}\n{"path": \n',
        }
        for name, text in manifests.items():
            (self.at / name).write_text(text)
        cases = [
            (["scans"], ["-o"]),
            (["-o", "out"], ["No scans were named"]),
            (["scans", "-o", "out"], ["a.drc", "scans/a.obj", "scans/a.ply", "{ext}"]),
            (["scans/a.ply", "more", "-o", "out"], ["a.drc", "more/a.ply", "{root}"]),
            (["more", "-o", "more"], ["more/a.drc", "among the scans"]),
            (["more/a.ply", "-o", "more", "--format", "ply"], ["more/a.ply", "would replace"]),
            (["more/a.ply", "-o", "file"], ["file", "no folder"]),
            (["empty", "-o", "out"], ["empty", "no scans"]),
            (["more", "-o", "out", "--exclude", "*.ply"], ["--exclude"]),
            (["nothing", "-o", "out"], ["nothing", "no such file or folder"]),
            (["gone.csv", "-o", "out"], ["gone.csv", "no such file or folder"]),
            (["more", "-o", "out", "--name", "{name}.drc"], ["'{name}'", "{stem}"]),
            (["more", "-o", "out", "--name", "{stem}.stl"], [".stl", ".drc"]),
            (["more", "-o", "out", "--format", "stl"], ["stl"]),
            (["more", "-o", "out", "--shard", "0/3"], ["--shard 0/3"]),
            (["more", "-o", "out", "--shard", "4/3"], ["--shard 4/3"]),
            (["more", "-o", "out", "--shard", "2"], ["--shard 2"]),
            (["more", "-o", "out", "--faces", "some"], ["--faces", "'some'"]),
            (["more", "-o", "out", "--faces", "5", "--ratio", "1"], ["--ratio"]),
            (["more", "-o", "out", "--jobs", "0"], ["--jobs"]),
            (["more", "-o", "out", "--no-such-option"], ["--no-such-option"]),
            (["more", "--write-manifest", "m.txt"], ["m.txt", ".jsonl"]),
            (["typo.csv", "-o", "out"], ["typo.csv: line 1", "'faces'"]),
            (["value.csv", "-o", "out"], ["value.csv: line 3", "symmetry"]),
            (["twice.csv", "-o", "out"], ["asked for twice", "output"]),
            (["out.csv", "-o", "out"], ["out.csv: line 2", "below"]),
            (["bad.jsonl", "-o", "out"], ["bad.jsonl: line 2", "JSON"]),
        ]
        for words, parts in cases:
            with self.subTest(words=words):
                said = self.refused(*words)
                for part in parts:
                    self.assertIn(part, said)


if __name__ == "__main__":
    unittest.main()
