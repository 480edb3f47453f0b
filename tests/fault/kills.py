# SPDX-License-Identifier: MIT
"""SIGKILL at random instants, also of the runs that resume, then a run to the end."""

import signal

from checks import expect_complete_or_absent, expect_done, remove
from program import resumed_stages

MOST_IN_A_ROW = 5


def kill_and_resume(bench, case, tally, most, instants=None):
    """One chain of at most `most` kills; returns how many there were. `instants` (shares of the
    undisturbed time) are drawn unless given."""
    random = bench.random
    reference = bench.reference(case)
    folder = bench.folder()
    where = f"{case.name} in {folder.name}"
    kills, seconds, cpu = 0, 0.0, 0.0
    while True:
        running = bench.start(case, folder)
        ended = None
        if kills < most and (kills == 0 or random.random() < 0.5):
            share = instants[kills] if instants else random.uniform(0.0, 1.05)
            ended = running.wait(share * reference.seconds)
            if ended is None:
                running.send(signal.SIGKILL)
                ended = running.wait(60)
            where += f", killed at {ended.seconds:.2f} s" if ended.code == -signal.SIGKILL else ""
        else:
            ended = running.finish(reference.limit)
        seconds += ended.seconds
        cpu += ended.cpu_seconds
        if ended.code != -signal.SIGKILL or ended.hung:
            break
        kills += 1
        expect_complete_or_absent(tally, folder, reference, where)
    ok = expect_done(tally, bench, case, folder, ended, where)
    tally.count("kills", kills)
    if kills and ok:
        tally.count("resumed to the undisturbed bytes")
        tally.count("stages resumed", resumed_stages(folder))
        judge_loss(tally, reference, kills, seconds, cpu, where)
    if ok:
        remove(folder)
    return kills


def judge_loss(tally, reference, kills, seconds, cpu, where):
    """A kill costs at most a tenth of the run and 5 s. Other load on the machine stretches wall
    time, so either clock may show it."""
    lost = (seconds - reference.seconds) / kills
    lost_cpu = (cpu - reference.ended.cpu_seconds) / kills
    threads = max(1.0, reference.ended.cpu_seconds / reference.seconds)
    tally.expect(lost <= 0.1 * reference.seconds + 5
                 or lost_cpu <= 0.1 * reference.ended.cpu_seconds + 5 * threads,
                 f"{where}: {kills} kills cost {lost:.1f} s each ({lost_cpu:.1f} s of CPU) of "
                 f"{reference.seconds:.1f} s")
    tally.most("most seconds lost by a kill", lost)
    if reference.seconds > 10:
        tally.most("most lost by a kill of a run over 10 s, share of its CPU time",
                   lost_cpu / reference.ended.cpu_seconds)


def run(bench, tally, cases, kills):
    """`cases` are pairs of case and share of the kills."""
    total = sum(share for _, share in cases)
    for number, (case, share) in enumerate(cases):
        left = sum(s for _, s in cases[number:])
        wanted = round((kills - tally.counts["kills"]) * share / left) if total else 0
        done = empty = 0
        while done < wanted and empty < 50:
            made = kill_and_resume(bench, case, tally, min(MOST_IN_A_ROW, wanted - done))
            done += made
            empty = 0 if made else empty + 1
        tally.log(f"kills: {case.name}: {done}")
