#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The batch of run.py on a Slurm of three nodes. While it runs a slurmd dies and leaves its tasks running
beside the copies that Slurm starts elsewhere, a node loses power, tasks have to make room for an urgent
job, and they run into their time limit of a minute. It has to end with the bytes of single runs, with nothing that was
finished done twice, and with the report written once all was done.

Usage: RATTAN=build/release/rattan RATTAN_SLURM_LOCAL=.../slurm-local [RATTAN_DATA=FOLDER]
       tests/batch/slurm_run.py [options]
Prints what it checks with figures, and exits 1 if anything is wrong. Wants root."""

import argparse
import json
import os
import random
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

import batch_checks as checks
import run
from run import check
from slurm_cluster import Cluster, why_not

RATTAN = os.environ["RATTAN"]


class Batch:
    """The submitted batch as seen from outside."""

    def __init__(self, cluster, scans, out, args):
        self.cluster = cluster
        self.out = out
        self.preempted = set()
        self.command = [RATTAN, "slurm", scans, "-o", out, "--include", "*", "--tasks", args.tasks,
                        "--cpus-per-task", "2", "--mem", "1200", "--time", "1"]
        said = cluster.run(*self.command)
        print(said, end="", flush=True)
        self.jobs = {name: job for job, name in re.findall(r"^job (\d+): (\S+)$", said, re.M)}

    def done(self):
        return sum(r["event"] == "end" and r["exit"] == 0 for r in checks.journal(self.out))

    def busy(self):
        """{task: node} of tasks that run."""
        tasks = {t: self.cluster.node_of(t) for t, state in self.cluster.queue().items()
                 if state == "RUNNING" and t.startswith(self.jobs["scans"] + "_")}
        return {t: node for t, node in tasks.items() if node}

    def log(self, task):
        path = self.out / ".rattan" / "slurm" / "logs" / f"{task}.log"
        return path.read_text() if path.exists() else ""

    def warnings(self):
        """{task: how often it was told to stop soon}"""
        return {t: log.count("told to stop soon") for t, log in self.logs().items()}

    def logs(self):
        return {p.stem: p.read_text()
                for p in (self.out / ".rattan" / "slurm" / "logs").glob("*_*.log")
                if not p.stem.startswith("merge")}


def say(what):
    print(f"[{time.monotonic() - say.began:5.1f} s] {what}", flush=True)


say.began = time.monotonic()


def trouble(batch):
    """Everything that goes wrong on a cluster, while the batch runs."""
    cluster = batch.cluster
    cluster.wait("the first scans", lambda: batch.done() >= 3)
    busy = batch.busy()
    orphan = min(busy, key=lambda t: list(busy.values()).count(busy[t]))
    dead = busy[orphan]
    cluster.crash(dead, "slurmd")
    say(f"slurmd of {dead} died and left {orphan} running, {batch.done()} scans done")
    cluster.wait("a copy elsewhere", lambda: batch.busy().get(orphan, dead) != dead)
    say(f"a copy runs on {batch.busy().get(orphan)}, {batch.done()} scans done")

    node = next(n for t, n in sorted(batch.busy().items()) if n != dead)
    cluster.crash(node)
    say(f"cut the power of {node}, {batch.done()} scans done")

    cluster.wait("tasks at work", lambda: set(batch.busy().values()) - {dead, node})
    busy, warned = batch.busy(), batch.warnings()
    urgent = cluster.run("sbatch", "--parsable", "-o", "/dev/null", "-p", "urgent", "-c", "4",
                         "--wrap", "sleep 3").strip()
    say(f"an urgent job wants a node, {batch.done()} scans done")
    cluster.wait("the urgent job", lambda: urgent not in cluster.queue())
    # A task that asks for another turn within its grace is none that Slurm calls preempted.
    place = cluster.field(urgent, "NodeList")[0]
    batch.preempted = {t for t, on in busy.items()
                       if on == place and batch.warnings()[t] > warned.get(t, 0)}
    say(f"it had {place}; {sorted(batch.preempted)} had to go")
    cluster.boot(node)
    cluster.boot(dead)
    say(f"{dead} and {node} are back, {batch.done()} scans done")


def overlaps(out):
    """Tasks of which two copies were at work at once."""
    seen = {}
    for record in checks.journal(out):
        if record.get("slurm"):
            spans = seen.setdefault(record["slurm"], {})
            span = spans.setdefault((record["host"], record["pid"]), [record["time"]] * 2)
            span[1] = max(span[1], record["time"])
    found = set()
    for task, spans in seen.items():
        ordered = sorted(spans.values())
        if any(b[0] < a[1] for a, b in zip(ordered, ordered[1:])):
            found.add(task)
    return found


def check_trouble(batch, args):
    controller = (batch.cluster.folder / "log" / "slurmctld.log").read_text()
    job = batch.jobs["scans"]
    restarts = [int(n) for n in batch.cluster.field(job, "Restarts")]
    check(len(restarts) == int(args.tasks) and sum(restarts) > 3,
          f"{sum(restarts)} restarts of {len(restarts)} tasks")
    failed = set(re.findall(rf"requeue (?:job )?JobId={job}_(\d+)\(\d+\) due to (?:node )?failure",
                            controller))
    check(failed, f"tasks requeued because their node failed: {sorted(failed)}")
    twice = overlaps(batch.out)
    check(twice, f"tasks of which two copies worked at once: {sorted(twice)}")
    check(batch.preempted, f"tasks that made room for an urgent job: {sorted(batch.preempted)}")
    limited = {t for t, count in batch.warnings().items() if count > (t in batch.preempted)}
    check(limited, f"tasks that were told that their time is up: {sorted(limited)}")
    turns = sum(log.count("asks for another turn") for log in batch.logs().values())
    check(turns > 0, f"tasks saved their work and asked for another turn {turns} times")
    check(not any("TIMEOUT" in s for s in batch.cluster.field(job, "JobState")),
          "no task was ended by its time limit")


def check_merge(batch, good, broken):
    cluster = batch.cluster
    merge = batch.jobs["merge"]
    check(cluster.field(merge, "ExitCode") == ["0:0"], "the merge found nothing missing")
    print("      " + batch.log(f"merge_{merge}").strip().replace("\n", "\n      "))
    report = json.loads((batch.out / "report.json").read_text())
    totals = report["totals"]
    check(totals["done"] == len(good) and totals["unusable"] == len(broken)
          and totals["scans"] == len(good) + len(broken), f"the report has {totals['done']} done, "
          f"{totals['unusable']} unusable of {totals['scans']}")
    ends = [r["time"] for r in checks.journal(batch.out) if r["event"] == "end"]
    written = (batch.out / "report.json").stat().st_mtime
    check(written > max(ends), f"the report was written {written - max(ends):.1f} s after the last "
          "scan ended")
    again = cluster.run(*batch.command)
    check(" 0 to do" in again and not cluster.queue(), "the same command submits nothing more")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--tasks", default="4")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="leave the files for inspection")
    args = parser.parse_args()
    reason = why_not()
    if reason:
        print(f"skipped: {reason}")
        return 0
    root = Path(tempfile.mkdtemp(prefix="rattan-slurm-run."))
    print(f"in {root}")
    cluster = None
    try:
        scans = root / "scans"
        scans.mkdir()
        good, broken = run.make_scans(scans, args.count, random.Random(args.seed))
        say(f"{len(good)} good scans, {len(broken)} broken ones, "
            f"{sum(p.stat().st_size for p in good) / 1e6:.0f} MB")
        (root / "single").mkdir()
        expected, seconds = run.single_runs(good, root / "single")
        say(f"single runs took {seconds:.1f} s together")
        # On one processor the batch lasts long enough for all that is to go wrong.
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        cluster = Cluster()
        batch = Batch(cluster, scans, root / "out", args)
        began = time.monotonic()
        trouble(batch)
        cluster.wait_until_empty(checks.FAR_TOO_LONG)
        say(f"all jobs have ended, {time.monotonic() - began:.1f} s after they were submitted")
        check_trouble(batch, args)
        run.check_outcome(scans, batch.out, good, broken, expected, "on Slurm")
        starts, ends, adopted = checks.check_nothing_twice(batch.out)
        check(True, f"nothing that was finished was begun again: {starts} attempts, {ends} ended, "
                    f"{adopted} found finished")
        check_merge(batch, good, broken)
    finally:
        if cluster is not None:
            if args.keep:
                shutil.copytree(cluster.folder / "log", root / "slurm-log")
            cluster.stop()
        if not args.keep:
            shutil.rmtree(root, ignore_errors=True)
    print(f"{len(run.failures)} wrong")
    return 1 if run.failures else 0


if __name__ == "__main__":
    sys.exit(main())
