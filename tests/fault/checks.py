# SPDX-License-Identifier: MIT
"""What every section asks of a run, and the tally of what was found."""

import shutil
from collections import Counter

from program import DONE, INTERRUPTED, NO_RESOURCE, facts, outputs, work_folder


class Skip(Exception):
    """The machine doesn't permit a section; the text says why."""


class Tally:
    """Counts and failures of one section."""

    def __init__(self, name, log):
        self.name = name
        self.counts = Counter()
        self.worst = {}
        self.failures = []
        self.skipped = None
        self.log = log

    def count(self, what, n=1):
        self.counts[what] += n

    def most(self, what, value):
        self.worst[what] = max(value, self.worst.get(what, value))

    def fail(self, sentence):
        self.failures.append(sentence)
        self.log(f"FAILED {self.name}: {sentence}")

    def expect(self, condition, sentence):
        if not condition:
            self.fail(sentence)
        return bool(condition)

    def summary(self):
        parts = [f"{n} {what}" for what, n in self.counts.items()]
        parts += [f"{what} {value:.2f}" for what, value in self.worst.items()]
        if self.skipped:
            parts.append(f"skipped: {self.skipped}")
        return ", ".join(parts) or "nothing done"


def expect_complete_or_absent(tally, folder, reference, where):
    """A file of an output's name has the undisturbed bytes."""
    for name, sum_ in outputs(folder).items():
        if not name.startswith("."):
            tally.expect(reference.files.get(name) == sum_, f"{where}: {name} is there, but isn't complete")


def expect_done(tally, bench, case, folder, ended, where):
    """Exit 0, the undisturbed bytes and facts, no work and no leftovers."""
    reference = bench.reference(case)
    ok = tally.expect(ended.code == DONE, f"{where}: {ended}")
    if ok:
        found = outputs(folder)
        ok = tally.expect(found == reference.files,
                          f"{where}: other files than undisturbed: "
                          + ", ".join(sorted(n for n in {*found, *reference.files}
                                             if found.get(n) != reference.files.get(n))))
        ok &= tally.expect(facts(folder) == reference.facts,
                           f"{where}: the report says other things than undisturbed: "
                           + ", ".join(n for n, v in facts(folder).items() if v != reference.facts[n]))
        ok &= tally.expect("--keep-work" in case.options or work_folder(folder) is None,
                           f"{where}: the work directory is still there")
    return ok


def expect_refusal(tally, ended, names, where, codes=(NO_RESOURCE,)):
    """A clean end with one sentence that names one of these and says what to do."""
    ok = tally.expect(ended.code in codes and not ended.hung,
                      f"{where}: expected exit {' or '.join(map(str, codes))}, not {ended}")
    if ok:
        said = ended.sentences()
        ok = tally.expect(len(said) == 1 and len(ended.errors.splitlines()) == 1 + len(ended.warnings()),
                          f"{where}: not one sentence: {ended}")
        ok = ok and tally.expect(any(str(n) in said[0] for n in names),
                                 f"{where}: names none of {', '.join(map(str, names))}: {said[0]}")
        ok = ok and tally.expect(said[0].rstrip().endswith(".") and said[0].count(". ") >= 1,
                                 f"{where}: no remedy: {said[0]}")
    return ok


def expect_interrupted(tally, ended, where):
    """Exit 75, and how to go on."""
    ok = tally.expect(ended.code == INTERRUPTED and not ended.hung,
                      f"{where}: expected exit {INTERRUPTED}, not {ended}")
    return ok and tally.expect(ended.sentences() and "run the same command again" in ended.sentences()[-1],
                               f"{where}: doesn't say how to go on: {ended}")


def remove(folder):
    shutil.rmtree(folder, ignore_errors=True)
