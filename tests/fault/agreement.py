# SPDX-License-Identifier: MIT
"""Same bytes for any threads and budget, and the peak resident set within the budget as the kernel counts
it."""

from dataclasses import replace

from checks import expect_done, remove
from program import DONE, Running, outputs

SETTINGS = [("--threads", "1"), ("--threads", "2"), ("--memory", "256MiB"), ("--memory", "1GiB"),
            ("--threads", "2", "--memory", "256MiB")]
UNITS = {"KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}


def same_bytes(bench, tally, cases):
    for case in cases:
        for setting in SETTINGS:
            folder = bench.folder()
            ended = bench.run(case, folder, *setting)
            tally.count("runs compared")
            if expect_done(tally, bench, case, folder, ended, f"{case.name} with {' '.join(setting)}"):
                remove(folder)


def size(text):
    return int(float(text[:-3]) * UNITS[text[-3:]])


def memory_bound(bench, tally, plans):
    """`plans` are (case, budgets). A budget that is too small for the case is refused; one that is
    accepted holds."""
    for case, budgets in plans:
        first = None
        for budget in budgets:
            folder = bench.folder()
            ended = Running(bench.words(case, folder, "--memory", budget)).finish(3600)
            where = f"{case.name} under {budget}"
            share = ended.peak_bytes / size(budget)
            tally.count("runs")
            tally.log(f"memory: {where}: peak {ended.peak_bytes >> 20} MiB, {share:.2f} of it, "
                      f"{ended.seconds:.1f} s")
            tally.expect(ended.code == DONE, f"{where}: {ended}")
            if ended.code == DONE:
                tally.most("highest peak / budget", share)
                tally.expect(share <= 1.0, f"{where}: peak {ended.peak_bytes >> 20} MiB")
                first = first or outputs(folder)
                tally.expect(outputs(folder) == first, f"{where}: other bytes than under {budgets[0]}")
            remove(folder)
