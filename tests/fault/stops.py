# SPDX-License-Identifier: MIT
"""SIGTERM, SIGINT and SIGUSR1: exit 75 within ten seconds, wherever the run is, and nothing lost."""

import signal
import time
from pathlib import Path

from checks import expect_complete_or_absent, expect_done, expect_interrupted, remove
from program import DONE, outputs, resumed_stages, work_folder

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
LONGEST_EXIT = 10.0


def timeline(reference):
    """Stages of the undisturbed run as (name, start, end), in shares of its time. What isn't a stage
    (start, reading of the command) comes first."""
    total = sum(s["seconds"] for s in reference.stages)
    at = max(0.0, reference.seconds - total)
    result = [("start", 0.0, at / reference.seconds)]
    for stage in reference.stages:
        end = at + stage["seconds"]
        result.append((stage["name"], at / reference.seconds, end / reference.seconds))
        at = end
    return result


def instants(reference, count, random):
    """Half of them anywhere, half in a stage chosen first, so that short ones and late ones get some."""
    spans = timeline(reference)
    result = []
    for k in range(count):
        if k % 2 == 0:
            result.append(random.random())
        else:
            _, start, end = spans[-1 - (k // 2) % len(spans)]
            result.append(random.uniform(start, end))
    return result


def stage_at(reference, share):
    return next((name for name, start, end in reversed(timeline(reference)) if share >= start), "start")


def await_handler(running, number):
    """Before its first lines of code a program can't do anything about a signal: it must catch it, or
    block it to wait for it."""
    while running.wait(0.005) is None:
        for line in Path(f"/proc/{running.pid}/status").read_text().splitlines():
            name, _, mask = line.partition(":")
            if name in ("SigCgt", "SigBlk") and int(mask, 16) >> (number - 1) & 1:
                return


def stop_and_resume(bench, tally, case, share, number):
    """Returns whether the run was caught."""
    reference = bench.reference(case)
    folder = bench.folder()
    where = (f"{case.name} in {folder.name}, {number.name} at {share * reference.seconds:.1f} s "
             f"({stage_at(reference, share)})")
    running = bench.start(case, folder)
    await_handler(running, number)
    ended = running.wait(share * reference.seconds - (time.monotonic() - running.start))
    if ended is not None:
        tally.expect(ended.code == DONE, f"{where}: {ended}")
        remove(folder)
        return False
    running.send(number)
    sent = time.monotonic() - running.start
    ended = running.finish(reference.limit)
    if ended.code == DONE:  # it was as good as done
        expect_done(tally, bench, case, folder, ended, where)
        remove(folder)
        return False
    tally.count(f"{number.name} in {stage_at(reference, share)}")
    tally.count("signals")
    tally.most("most seconds to exit", ended.seconds - sent)
    ok = expect_interrupted(tally, ended, where)
    ok &= tally.expect(ended.seconds - sent <= LONGEST_EXIT,
                       f"{where}: {ended.seconds - sent:.1f} s to exit")
    expect_complete_or_absent(tally, folder, reference, where)
    left = [n for n in outputs(folder) if n.startswith(".") or not case.several]
    ok &= tally.expect(not left, f"{where}: leaves {left}")
    tally.count("of them with work saved", work_folder(folder) is not None)
    ended = bench.run(case, folder)
    if expect_done(tally, bench, case, folder, ended, where) and ok:
        tally.count("stages resumed", resumed_stages(folder))
        remove(folder)
    return True


def run(bench, tally, plans):
    """`plans` are (case, number of signals)."""
    for case, count in plans:
        reference = bench.reference(case)
        done = 0
        for share in instants(reference, 3 * count, bench.random):
            if done == count:
                break
            done += stop_and_resume(bench, tally, case, share, SIGNALS[done % len(SIGNALS)])
        tally.expect(done == count, f"{case.name}: only {done} of {count} signals came in time")
