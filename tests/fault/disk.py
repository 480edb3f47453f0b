# SPDX-License-Identifier: MIT
"""A full disk: the work directory, the output or both on a small tmpfs, at sizes from tiny to just too
small; then it gets more room."""

import os
import shutil
import subprocess
import time

from checks import Skip, expect_complete_or_absent, expect_done, expect_refusal, remove
from program import DONE, digest, resumed_stages

AMPLE = 4 << 30


class SmallDisk:
    """A tmpfs at `path` while the context lasts."""

    def __init__(self, path, size):
        self.path, self.size = path, size

    def __enter__(self):
        self.path.mkdir(exist_ok=True)
        mount(["-t", "tmpfs", "-o", f"size={self.size}", "rattan-fault", self.path])
        return self

    def __exit__(self, *_):
        subprocess.run(["umount", self.path], capture_output=True)

    def resize(self, size):
        mount(["-o", f"remount,size={size}", self.path])

    def used(self):
        s = os.statvfs(self.path)
        return (s.f_blocks - s.f_bfree) * s.f_frsize


def mount(words):
    done = subprocess.run(["mount", *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise Skip(f"no file system can be mounted here ({done.stderr.strip()})")


def most_used(bench, case, tally):
    """Bytes that the work of an undisturbed run takes on such a disk, as sampled."""
    with SmallDisk(bench.scratch / "disk", AMPLE) as disk:
        folder = bench.folder()
        running = bench.start(case, folder, "--work-dir", disk.path / "w.work")
        most = 0
        while running.wait(0.002) is None:
            most = max(most, disk.used())
        expect_done(tally, bench, case, folder, running.ended, f"{case.name} on an ample disk")
        tally.expect(not list(disk.path.iterdir()), f"{case.name}: leaves work on an ample disk")
        remove(folder)
    return most


def fill_by_work(bench, tally, case, size):
    """The work doesn't fit. Returns whether the size was too small."""
    with SmallDisk(bench.scratch / "disk", size) as disk:
        folder = bench.folder()
        work = disk.path / "w.work"
        where = f"{case.name} in {folder.name}, work on {size} bytes"
        reference = bench.reference(case)
        ended = bench.run(case, folder, "--work-dir", work)
        if ended.code == DONE:
            expect_done(tally, bench, case, folder, ended, where)
            remove(folder)
            return False
        tally.count("full disks under the work")
        expect_refusal(tally, ended, [work], where)
        expect_complete_or_absent(tally, folder, reference, where)
        left = [n for n in os.listdir(folder) if n.startswith(".") or not case.several]
        tally.expect(not left, f"{where}: leaves {left}")
        start = time.monotonic()
        disk.resize(AMPLE)
        ended = bench.run(case, folder, "--work-dir", work)
        if expect_done(tally, bench, case, folder, ended, f"{where}, then room"):
            tally.count("stages resumed", resumed_stages(folder))
            tally.expect(not list(disk.path.iterdir()), f"{where}: the work directory is still there")
            remove(folder)
        tally.most("most seconds of a resumed run", time.monotonic() - start)
    return True


def fill_by_output(bench, tally, case, share, old):
    """Everything on the disk that the run writes beside the work doesn't fit; an older output stays."""
    reference = bench.reference(case)
    with SmallDisk(bench.scratch / "disk", AMPLE) as disk:
        folder = disk.path / "out"
        folder.mkdir()
        work = bench.folder() / "w.work"
        first = folder / next(iter(reference.files))
        if old:
            first.write_bytes(b"older " * 100)
        size = sum(os.path.getsize(p) for p in folder.iterdir())
        need = output_bytes(bench, case)
        limit = size + max(4096, int(share * need))
        where = f"{case.name}, output on {limit} bytes"
        disk.resize(limit)
        ended = bench.run(case, folder, "--work-dir", work)
        tally.count("full disks under the output")
        expect_refusal(tally, ended, [folder], where)
        if old:
            # Of several files, those before the one that didn't fit are in place.
            tally.expect(first.read_bytes() == b"older " * 100
                         or case.several and digest(first) == reference.files[first.name],
                         f"{where}: the older output is damaged")
        else:
            expect_complete_or_absent(tally, folder, reference, where)
        tally.expect(not list(folder.glob(".*")), f"{where}: leaves {os.listdir(folder)}")
        disk.resize(AMPLE)
        ended = bench.run(case, folder, "--work-dir", work)
        if expect_done(tally, bench, case, folder, ended, f"{where}, then room"):
            tally.count("stages resumed", resumed_stages(folder))
            tally.expect(not work.exists(), f"{where}: the work directory is still there")
        shutil.rmtree(work.parent, ignore_errors=True)


def output_bytes(bench, case):
    folder = bench.folder()
    bench.run(case, folder)
    total = sum(p.stat().st_size for p in folder.iterdir() if p.name != "report.json")
    remove(folder)
    return total


def run(bench, tally, cases, points):
    """About three in four points are of the work, the others of the output."""
    random = bench.random
    with SmallDisk(bench.scratch / "disk", 1 << 20):
        pass
    by_output = max(1, points // 4)
    for number, case in enumerate(cases):
        most = most_used(bench, case, tally)
        tally.log(f"disk: the work of {case.name} takes {most} bytes")
        if most == 0:
            tally.fail(f"{case.name}: the work never reached the disk")
            continue
        mine = (points - by_output) // len(cases) + (number < (points - by_output) % len(cases))
        for k in range(mine):
            share = (0.02, 0.98)[k] if k < 2 else random.uniform(0.02, 0.98)
            while not fill_by_work(bench, tally, case, max(4096, int(share * most))) and share > 0.01:
                share *= 0.9
    for k in range(by_output):
        fill_by_output(bench, tally, cases[k % len(cases)], random.uniform(0.0, 0.9), k % 2 == 1)
