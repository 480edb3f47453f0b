# SPDX-License-Identifier: MIT
"""Calls that fail: the N-th write, truncate, fsync, rename or open of the run, with ENOSPC or EIO, once or
from then on. Short and interrupted writes are no errors at all."""

import errno

from calls import build_shim, count_kinds, environment, read_log
from checks import expect_complete_or_absent, expect_done, expect_refusal, remove
from program import DONE

KINDS = ("write", "truncate", "sync", "rename", "open")


def plan(bench, case, shim):
    """How many calls of each kind the undisturbed run makes."""
    folder = bench.folder()
    log = bench.scratch / f"{folder.name}.log"
    bench.run(case, folder, environment=environment(shim, folder, log=log))
    counts = count_kinds(read_log(log))
    remove(folder)
    log.unlink()
    return counts


def fail_once(bench, tally, case, shim, kind, at):
    random = bench.random
    number = random.choice([errno.ENOSPC, errno.EIO])
    sticky = random.random() < 0.3
    folder = bench.folder()
    where = (f"{case.name} in {folder.name}, {kind} {at}{' and all after' if sticky else ''} fails with "
             f"{errno.errorcode[number]}")
    reference = bench.reference(case)
    log = bench.scratch / f"{folder.name}.log"
    ended = bench.run(case, folder, environment=environment(
        shim, folder, on=kind, at=at, do=number, sticky=sticky, log=log))
    tally.count("faults")
    if ended.code == DONE:
        # Nothing but what is no promise may fail in silence, and then the output is right.
        tally.count(f"of {kind} without consequence")
        tally.expect(kind in ("sync", "open", "truncate") or not reached(log, kind, at),
                     f"{where}: exit 0")
        expect_done(tally, bench, case, folder, ended, where)
    else:
        expect_refusal(tally, ended, [folder], where)
    expect_complete_or_absent(tally, folder, reference, where)
    leftovers = [p.name for p in folder.glob(".*")]
    tally.expect(not leftovers or sticky, f"{where}: leaves {leftovers}")
    again = bench.run(case, folder)
    if expect_done(tally, bench, case, folder, again, f"{where}; the run after"):
        remove(folder)
    log.unlink(missing_ok=True)


def reached(log, kind, at):
    return count_kinds(read_log(log))[kind] + 1 >= at


def run(bench, tally, cases, faults):
    shim = build_shim(bench.scratch)
    random = bench.random
    for number, case in enumerate(cases):
        counts = plan(bench, case, shim)
        tally.log(f"writes: {case.name} makes " + ", ".join(f"{counts[k]} {k}" for k in KINDS))
        mine = faults // len(cases) + (number < faults % len(cases))
        usable = [k for k in KINDS if counts[k]]
        for k in range(mine):
            kind = usable[k % len(usable)]
            fail_once(bench, tally, case, shim, kind, random.randint(1, counts[kind]))
        for what in ("short", "interrupt"):
            for _ in range(max(1, mine // 10)):
                at = random.randint(1, max(1, counts["write"]))
                folder = bench.folder()
                ended = bench.run(case, folder, environment=environment(
                    shim, folder, on="write", at=at, do=what))
                tally.count(f"{what} writes")
                if expect_done(tally, bench, case, folder, ended,
                               f"{case.name} in {folder.name}, write {at} is {what}"):
                    remove(folder)
