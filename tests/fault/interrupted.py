# SPDX-License-Identifier: MIT
"""Interrupted work to tamper with: what a killed or stopped run left, kept to be copied."""

import shutil
import signal

from program import DONE, work_folder


def interrupt(bench, case, folder, share, number=signal.SIGKILL, more=(), tries=8):
    """Runs in folder and stops it at that share of the undisturbed time, sooner if it was too late.
    Returns how the run ended, or None if it was never caught."""
    reference = bench.reference(case)
    for _ in range(tries):
        running = bench.start(case, folder, *more)
        ended = running.wait(share * reference.seconds)
        if ended is None:
            running.send(number)
            ended = running.finish(reference.limit)
        if ended.code != DONE:
            return ended
        shutil.rmtree(folder)
        folder.mkdir()
        share *= 0.8
    return None


def snapshots(bench, case, shares):
    """Folders with the work of runs interrupted about there, most advanced last."""
    result = []
    for k, share in enumerate(shares):
        folder = bench.folder()
        number = (signal.SIGKILL, signal.SIGTERM)[k % 2]
        if interrupt(bench, case, folder, share, number) and store_files(folder):
            result.append(folder)
        else:
            shutil.rmtree(folder)
    return result


def store_files(folder):
    """Of the work there, in order of their names. Not the lock: a record that can't be read is taken for
    another host's until its heartbeat is old."""
    work = work_folder(folder)
    return sorted(p for p in work.rglob("*") if p.is_file() and p.stat().st_size > 0
                  and not p.name.startswith("lock.")) if work else []


def copy(bench, snapshot):
    """The scene again, in a folder of its own with files of its own."""
    folder = bench.folder()
    shutil.copytree(snapshot, folder, dirs_exist_ok=True)
    return folder
