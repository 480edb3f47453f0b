# SPDX-License-Identifier: MIT
"""Power cuts: the run is killed at one of its calls, then what the disk hadn't been asked to keep is lost,
as far as the log of calls allows: data written since the file's last fsync become zeros or are cut off,
names made, changed or removed since the directory's last fsync return to what they were."""

import os
import shutil
import signal

from calls import build_shim, count_kinds, environment, read_log
from checks import expect_complete_or_absent, expect_done, remove
from program import resumed_stages


def cut_power(calls, folder, graves, random):
    """Takes away from folder what may be lost; returns how many files and names lost something."""
    data, names = unsynced(calls)
    lost = undo_names(names, graves, random)
    by_inode = {p.stat().st_ino: p for p in folder.rglob("*") if p.is_file()}
    for inode, writes in data.items():
        if inode in by_inode and writes:
            lost += lose_data(by_inode[inode], writes, random)
    return lost


def unsynced(calls):
    """Writes by inode, and changes of names in order, that no fsync followed."""
    data, names = {}, []
    for call in calls:
        if call.kind == "C":
            data[call.inode] = []
            names.append(call)
        elif call.kind == "W":
            data.setdefault(call.inode, []).append((call.number, call.length))
        elif call.kind == "T":
            data.setdefault(call.inode, []).append((call.number, 0))
        elif call.kind == "S":
            data.pop(call.inode, None)
            names = [c for c in names if not {call.path} >= {c.path.parent, (c.target or c.path).parent}]
        else:
            names.append(call)
    return data, names


def undo_names(names, graves, random):
    """The last few changes are lost: a file system keeps their order."""
    undone = 0
    for call in reversed(names[random.randint(0, len(names)):]):
        grave = graves / str(call.number)
        if call.kind == "C":
            call.path.unlink(missing_ok=True)
        elif call.kind == "M":
            shutil.rmtree(call.path, ignore_errors=True)
        elif call.kind == "R" and call.target.exists():
            call.path.parent.mkdir(exist_ok=True)
            os.rename(call.target, call.path)
            if call.number and grave.exists():
                os.link(grave, call.target)
        elif call.kind == "U" and call.number and grave.exists() and not call.path.exists():
            call.path.parent.mkdir(exist_ok=True)
            os.link(grave, call.path)
        elif call.kind == "D":
            call.path.mkdir(exist_ok=True)
        undone += 1
    return undone


def lose_data(path, writes, random):
    how = random.choice(["all", "some", "end", "none"])
    size = path.stat().st_size
    if how == "none":
        return 0
    if how == "end":
        os.truncate(path, min(size, random.choice(writes)[0]))
        return 1
    with open(path, "r+b") as file:
        for offset, length in writes:
            length = min(length, size - offset)
            if length > 0 and (how == "all" or random.random() < 0.5):
                file.seek(offset)
                file.write(bytes(length))
    return 1


def run(bench, tally, cases, cuts):
    shim = build_shim(bench.scratch)
    random = bench.random
    totals = {}
    for number in range(cuts):
        case = cases[number % len(cases)]
        reference = bench.reference(case)
        folder, graves = bench.folder(), bench.folder()
        if case not in totals:
            log = graves / "log"
            bench.run(case, folder, environment=environment(shim, folder, log=log))
            totals[case] = count_kinds(read_log(log))
            remove(folder)
            folder.mkdir()
            log.unlink()
        # Most calls write; half of the cuts come at the others.
        kinds = random.choice(["write truncate", "sync rename open unlink"])
        calls = sum(totals[case][k] for k in kinds.split())
        at = random.randint(1, max(1, calls))
        log = graves / "log"
        ended = bench.run(case, folder, environment=environment(
            shim, folder, on=kinds, at=at, do="kill", log=log, graves=graves))
        where = f"{case.name} in {folder.name}, power cut at call {at} of {kinds}"
        if ended.code == -signal.SIGKILL:
            lost = cut_power(read_log(log), folder, graves, random)
            tally.count("power cuts")
            tally.count("files and names that lost something", lost)
        expect_complete_or_absent(tally, folder, reference, where)
        ended = bench.run(case, folder)
        if expect_done(tally, bench, case, folder, ended, where):
            tally.count("stages resumed", resumed_stages(folder))
            remove(folder)
        remove(graves)
