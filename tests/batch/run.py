#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A batch of 200 scans as users have them: of all sizes, sample models, and 20 broken files. Made once
undisturbed, and once killed five times; both have to end with the bytes of single runs.

Usage: RATTAN=build/release/rattan [RATTAN_DATA=FOLDER] tests/batch/run.py [options]
Prints what it checks with figures, and exits 1 if anything is wrong."""

import argparse
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import batch_checks as checks

RATTAN = os.environ["RATTAN"]
SAMPLES = ("3holes.off", "bun_zipper.ply", "bunny25k.obj", "demosthenes-low-res.obj", "fandisk.obj",
           "fertility.off", "gargoyle.obj", "koala.obj", "nefertiti.obj", "plane_holes.obj",
           "rocker-arm.obj", "spot.obj")
# Of each kind of damage that tests/end_to_end/bad_input_test.py knows.
BROKEN = ("empty.ply", "prose.obj", "garbage.drc", "garbage.ply", "cut_header.ply", "cut.ply", "cut.obj",
          "cut_binary.stl", "cut.off", "cut.drc", "huge_vertices.ply", "huge.off", "huge.stl",
          "huge_1.drc", "index_0.obj", "points.ply", "all_nan.ply", "utf16.obj", "archive.ply",
          "checksum.ply.gz")

failures = []


def check(condition, what):
    print(f"{'ok   ' if condition else 'WRONG'} {what}", flush=True)
    if not condition:
        failures.append(what)


def make_scans(folder, count, rng):
    """Good ones, broken ones: paths."""
    from bad_input_test import refused_files
    good, broken = [], []
    data = os.environ.get("RATTAN_DATA")
    if data:
        (folder / "samples").mkdir()
        for name in SAMPLES:
            good.append(folder / "samples" / name)
            shutil.copy(Path(data) / name, good[-1])
    else:
        print("no RATTAN_DATA: without the sample scans")
    (folder / "broken").mkdir()
    for name, content, _ in refused_files():
        if name in BROKEN:
            # Several would have one output: "cut.ply", "cut.obj".
            broken.append(folder / "broken" / Path(name).suffix[1:] / name)
            broken[-1].parent.mkdir(exist_ok=True)
            broken[-1].write_bytes(content)
    assert len(broken) == len(BROKEN)
    commands = []
    while len(good) + len(broken) < count:
        k = len(good)
        triangles = int(math.exp(rng.uniform(math.log(3e3), math.log(6e5))))
        place = folder / "synth" / f"box {k % 7}"
        place.mkdir(parents=True, exist_ok=True)
        good.append(place / f"scan{k:03}.ply")
        commands.append([RATTAN, "synth", "-o", good[-1], "--triangles", str(triangles), "--seed",
                         str(k), "--genus", str(k % 4), "--holes", str(k % 3), "--quiet"])
    with ThreadPoolExecutor(2) as pool:
        for done in pool.map(subprocess.run, commands):
            done.check_returncode()
    return good, broken


def single_runs(scans, folder):
    """Digest of what a run of its own makes of each scan, and their wall times."""
    def run(k):
        out = folder / f"{k}.drc"
        began = time.monotonic()
        subprocess.run([RATTAN, "remesh", scans[k], "-o", out, "--quiet", "--threads", "1"],
                       check=True)
        seconds = time.monotonic() - began
        made = checks.digest(out)
        out.unlink()
        return made, seconds
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(run, range(len(scans))))
    return [r[0] for r in results], sum(r[1] for r in results)


def command(scans, out, args, *more):
    return [str(w) for w in (RATTAN, "batch", scans, "-o", out, "--threads", args.threads,
                             "--memory", args.memory, *more)]


def undisturbed(scans, out, args):
    """Wall seconds."""
    most = [0]
    began = time.monotonic()
    said = out.parent / "said.txt"
    with said.open("wb") as errors:
        batch = subprocess.Popen(command(scans, out, args), stdout=subprocess.DEVNULL, stderr=errors)

    def watch():
        while batch.returncode is None:
            most[0] = max(most[0], checks.tree_rss(batch.pid))
            time.sleep(0.02)
    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    _, status, used = os.wait4(batch.pid, 0)
    wall = time.monotonic() - began
    batch.returncode = os.waitstatus_to_exitcode(status)
    watcher.join()
    check(batch.returncode == 3, f"exit code {batch.returncode} of a batch with broken scans is 3")
    if batch.returncode == 2:
        sys.exit(said.read_text())
    outside = (used.ru_utime + used.ru_stime) / (wall * args.threads)
    end = [r for r in checks.journal(out) if r["event"] == "batch" and r["action"] == "end"][-1]
    inside = end["cpu_seconds"] / (end["seconds"] * args.threads)
    check(outside > args.least_use and inside > args.least_use,
          f"{100 * outside:.1f} % of {args.threads} processors used as seen from outside, "
          f"{100 * inside:.1f} % by the batch's own record, in {wall:.1f} s")
    busy = sum(e["seconds"] for tries in checks.attempts(out).values() for _, e in tries)
    print(f"      {100 * busy / (end['seconds'] * args.threads):.1f} % of the time of {args.threads} "
          "threads given to scans")
    budget = parse_bytes(args.memory)
    check(most[0] <= budget, f"{most[0] / 2**20:.0f} MiB of all processes at most, of "
                             f"{budget / 2**20:.0f} allowed")
    return wall


def parse_bytes(text):
    units = {"GiB": 2**30, "MiB": 2**20}
    return int(text[:-3]) * units[text[-3:]]


def check_outcome(scans, out, good, broken, expected, what):
    names = [str(p.relative_to(scans)) for p in good]
    made = checks.outputs(out)
    check(len(made) == len(good), f"{what}: {len(made)} outputs of {len(good)} scans")
    wrong = [name for name, bytes_ in zip(names, expected)
             if made.get(str(Path(name).with_suffix(".drc"))) != bytes_]
    check(not wrong, f"{what}: the bytes are those of single runs {wrong[:5] or ''}")
    exits = checks.last_exits(out)
    check(sorted(exits.values(), key=str) == sorted([0] * len(good) + [3] * len(broken), key=str),
          f"{what}: {len(good)} done and {len(broken)} unusable by the journal")
    logs = {str(p.relative_to(out)) for p in out.rglob("*.log") if ".rattan" not in p.parts}
    check(len(logs) == len(broken), f"{what}: {len(logs)} logs of failures")
    left = checks.leftovers(out)
    check(not left, f"{what}: nothing is left over {left[:5] or ''}")


def kill(batch, everything):
    """The batch alone, or with all its children at the same instant."""
    children = checks.children_of(batch.pid)
    if everything:
        os.kill(batch.pid, signal.SIGSTOP)
        for child in children:
            try:
                os.kill(child, signal.SIGKILL)
            except ProcessLookupError:
                pass
    os.kill(batch.pid, signal.SIGKILL)
    batch.wait()
    return len(children)


def killed(scans, out, args, wall, rng):
    for number in range(args.kills):
        batch = subprocess.Popen(command(scans, out, args), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(0.08, 0.2) * wall)
        if batch.poll() is not None:
            check(False, f"kill {number + 1} comes before the end")
            return
        everything = number % 2 == 0
        running = kill(batch, everything)
        exits = list(checks.last_exits(out).values())
        print(f"      killed {'all' if everything else 'the batch alone'} with {running} running, "
              f"{exits.count(0)} done")
    done = subprocess.run(command(scans, out, args), stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True)
    check(done.returncode == 3, f"exit code {done.returncode} after {args.kills} kills is 3")
    try:
        starts, ends, adopted = checks.check_nothing_twice(out)
        check(True, f"nothing finished was done twice: {starts} starts, {ends} ends, {adopted} found "
                    "finished")
    except AssertionError as error:
        check(False, str(error))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scans", type=int, default=200)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--memory", default="1GiB")
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--least-use", type=float, default=0.9,
                        help="share of the processors; lower it on a machine that others use")
    parser.add_argument("--keep", help="folder to work in and keep")
    args = parser.parse_args()
    rng = random.Random(args.seed)
    root = Path(args.keep or tempfile.mkdtemp(prefix="rattan-batch."))
    try:
        scans = root / "scans"
        scans.mkdir(parents=True)
        good, broken = make_scans(scans, args.scans, rng)
        size = sum(p.stat().st_size for p in good) / 1e6
        print(f"      {len(good)} good scans of {size:.0f} MB, {len(broken)} broken")
        expected, seconds = single_runs(good, root)
        print(f"      single runs, two at a time: {seconds / 2:.1f} s")
        wall = undisturbed(scans, root / "out", args)
        check_outcome(scans, root / "out", good, broken, expected, "undisturbed")
        records = len(list(checks.journal(root / "out")))
        subprocess.run(command(scans, root / "out", args), capture_output=True)
        more = len(list(checks.journal(root / "out"))) - records
        check(more == 2, f"run again, nothing is done: {more} records more, of the batch itself")
        killed(scans, root / "killed", args, wall, rng)
        check_outcome(scans, root / "killed", good, broken, expected, "killed")
    finally:
        if not args.keep:
            shutil.rmtree(root, ignore_errors=True)
    print(f"{len(failures)} wrong" if failures else "all right")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
