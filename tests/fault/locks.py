# SPDX-License-Identifier: MIT
"""Several processes on one work directory: exactly one proceeds, whoever died leaves no lock behind."""

import os
import signal
import socket
import threading
import time

from checks import expect_complete_or_absent, expect_done, expect_refusal, remove
from interrupted import interrupt
from program import DONE, work_folder

ELSEWHERE = "another-host.example"
REFUSED_WITHIN = 10.0


def find_lock(folder, pid):
    """The record of the work there that says which process of this host owns it."""
    work = work_folder(folder)
    for path in sorted(work.glob("lock.*")) if work else []:
        text = path.read_text(errors="replace")
        if f"pid={pid}\n" in text and f"host={socket.gethostname()}\n" in text:
            return path
    return None


def await_lock(running, folder, seconds=30):
    end = time.monotonic() + seconds
    while time.monotonic() < end and running.wait(0.01) is None:
        lock = find_lock(folder, running.pid)
        if lock:
            return lock
    return None


def expect_turned_away(bench, tally, case, folder, where, names=()):
    """Another run there says that the work is in use, soon."""
    return judge_turned_away(tally, bench.run(case, folder), folder, where, names)


def judge_turned_away(tally, ended, folder, where, names=()):
    tally.count("turned away")
    tally.expect(ended.seconds <= REFUSED_WITHIN, f"{where}: {ended.seconds:.1f} s to say so")
    return expect_refusal(tally, ended, [folder, *names], where)


def second_process(bench, tally, case, share, paused):
    """One runs (or is stopped by SIGSTOP, which is no death); a second one comes."""
    folder = bench.folder()
    where = f"{case.name} in {folder.name}, second process at {share:.2f}{', first paused' if paused else ''}"
    reference = bench.reference(case)
    first = bench.start(case, folder)
    if tally.expect(await_lock(first, folder), f"{where}: no lock that names host and process"):
        first.wait(share * reference.seconds - (time.monotonic() - first.start))
        first.send(signal.SIGSTOP)
        if not paused:
            first.send(signal.SIGCONT)
        second = bench.run(case, folder)
        if first.wait(0) is None:  # else the second may have come when the first was done
            judge_turned_away(tally, second, folder, where)
        first.send(signal.SIGCONT)
    if expect_done(tally, bench, case, folder, first.finish(reference.limit), f"{where}, the first"):
        remove(folder)


def one_after_another(started, reference):
    """Whether those that proceeded did so in turn: on a busy machine one may come when another is done,
    and then it has the whole of the work to do."""
    ends = sorted(r.start + r.ended.seconds for r in started if r.ended.code == DONE)
    whole = 0.5 * reference.ended.cpu_seconds / (os.cpu_count() or 1)
    return all(b - a >= whole for a, b in zip(ends, ends[1:]))


def at_once(bench, tally, case, processes, after_kill):
    """Several start at the same time, on nothing or on the lock of a killed one."""
    folder = bench.folder()
    where = f"{case.name} in {folder.name}, {processes} at once{' after a kill' if after_kill else ''}"
    reference = bench.reference(case)
    if after_kill:
        interrupt(bench, case, folder, 0.6)
    started = [bench.start(case, folder) for _ in range(processes)]
    ended = [r.finish(reference.limit) for r in started]
    done = [e for e in ended if e.code == DONE]
    tally.count("races")
    tally.count("taken over" if after_kill else "begun", len(done))
    tally.expect(done and one_after_another(started, reference),
                 f"{where}: {len(done)} proceeded: " + "; ".join(map(str, ended)))
    for e in ended:
        if e.code != DONE:
            expect_refusal(tally, e, [folder], where)
    if done and expect_done(tally, bench, case, folder, done[0], where):
        remove(folder)
    else:
        expect_complete_or_absent(tally, folder, reference, where)


def leave_a_lock(bench, tally, case, where):
    """A killed run's folder and its lock."""
    folder = bench.folder()
    running = bench.start(case, folder)
    lock = await_lock(running, folder)
    running.wait(0.5 * bench.reference(case).seconds)
    running.send(signal.SIGKILL)
    running.finish(60)
    tally.expect(lock and lock.exists(), f"{where}: no lock left by a killed run")
    return folder, lock if lock and lock.exists() else None, running.pid


def take_over(bench, tally, case, what, change):
    """After change(lock, pid) the lock of a dead process is taken over."""
    where = f"{case.name}, {what}"
    folder, lock, pid = leave_a_lock(bench, tally, case, where)
    where += f", in {folder.name}"
    if not lock:
        return
    change(lock, pid)
    ended = bench.run(case, folder)
    tally.count("taken over")
    tally.most("most seconds to take over and finish", ended.seconds)
    if expect_done(tally, bench, case, folder, ended, where):
        remove(folder)


def change_record(lock, **values):
    """Another text after `name=`, where the record has it."""
    lines = lock.read_text().splitlines()
    lines = [f"{n}={values[n]}" if (n := line.partition("=")[0]) in values else line for line in lines]
    lock.write_text("\n".join(lines) + "\n")


def let_age(lock, _pid=None):
    """The heartbeat was long ago."""
    old = time.time() - 6 * 3600
    os.utime(lock, (old, old))


def move_elsewhere(lock, _pid=None):
    """The record as another host would have left it long ago."""
    change_record(lock, host=ELSEWHERE, boot="0b5e77ed-0000-4000-8000-000000000000")
    let_age(lock)


def reboot(lock, _pid):
    """The record of this host before it was started again."""
    change_record(lock, boot="0b5e77ed-0000-4000-8000-000000000000")
    let_age(lock)


def reuse_pid(lock, _pid):
    change_record(lock, pid=os.getpid())


def empty(lock, _pid):
    lock.write_text("")
    let_age(lock)


def alive_elsewhere(bench, tally, case):
    """Another host's heartbeat goes on: turned away, by its name. It stops: taken over."""
    where = f"{case.name}, a live process elsewhere"
    folder, lock, _ = leave_a_lock(bench, tally, case, where)
    if not lock:
        return
    move_elsewhere(lock)
    stop = threading.Event()

    def beat():
        while not stop.wait(0.2):
            os.utime(lock)

    os.utime(lock)
    heart = threading.Thread(target=beat)
    heart.start()
    try:
        expect_turned_away(bench, tally, case, folder, where, [ELSEWHERE])
    finally:
        stop.set()
        heart.join()
    let_age(lock)
    if expect_done(tally, bench, case, folder, bench.run(case, folder), f"{where}, then dead"):
        remove(folder)


def wakes_up(bench, tally, case):
    """A process sleeps past its heartbeat (a suspended machine) and its lock is gone when it wakes: another
    has taken over. Neither spoils the other's work; the output is never but whole."""
    folder = bench.folder()
    where = f"{case.name} in {folder.name}, asleep while another takes over"
    reference = bench.reference(case)
    sleeper = bench.start(case, folder)
    lock = await_lock(sleeper, folder)
    sleeper.wait(0.5 * reference.seconds - (time.monotonic() - sleeper.start))
    sleeper.send(signal.SIGSTOP)
    if lock and lock.exists():
        lock.unlink()
    other = bench.start(case, folder)
    other.wait(0.5 * reference.seconds)
    sleeper.send(signal.SIGCONT)
    for ended in (sleeper.finish(reference.limit), other.finish(reference.limit)):
        if ended.code != DONE:
            expect_refusal(tally, ended, [folder], where)
        expect_complete_or_absent(tally, folder, reference, where)
    tally.count("sleepers")
    if expect_done(tally, bench, case, folder, bench.run(case, folder), f"{where}, the run after"):
        remove(folder)


def run(bench, tally, case, rounds):
    for k in range(rounds):
        second_process(bench, tally, case, bench.random.uniform(0.1, 0.7), k % 2 == 1)
        at_once(bench, tally, case, 3, k % 2 == 1)
    take_over(bench, tally, case, "the lock of a killed process", lambda lock, pid: None)
    take_over(bench, tally, case, "its pid reused by another program", reuse_pid)
    take_over(bench, tally, case, "an empty record", empty)
    take_over(bench, tally, case, "the host started again", reboot)
    take_over(bench, tally, case, "a dead process elsewhere", move_elsewhere)
    alive_elsewhere(bench, tally, case)
    wakes_up(bench, tally, case)
