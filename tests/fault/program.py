# SPDX-License-Identifier: MIT
"""Runs of the program: a case (scan and options) in a folder of its own, how the run ended, and what the
undisturbed run of the same case gave."""

import hashlib
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

DONE, REFUSED_INPUT, NO_RESOURCE, INTERRUPTED = 0, 3, 4, 75


@dataclass(frozen=True)
class Case:
    name: str
    scan: Path
    options: tuple = ()
    output: str = "out.drc"
    often: bool = True  # a checkpoint after every step, as only long runs have enough of them
    command: str = "remesh"

    @property
    def several(self):
        """Whether files come one after the other: a run that is interrupted may leave some complete."""
        return self.command == "layout" or "," in " ".join(self.options)


@dataclass
class Ended:
    """A finished run. code is negative for a signal; errors is what it wrote to stderr."""
    code: int
    seconds: float
    cpu_seconds: float
    peak_bytes: int
    errors: str
    hung: bool

    def sentences(self):
        return [line for line in self.errors.splitlines() if line.startswith("rattan: ")]

    def warnings(self):
        return [line for line in self.errors.splitlines() if line.startswith("warning: ")]

    def __str__(self):
        how = "hung" if self.hung else (f"exit {self.code}" if self.code >= 0 else
                                        signal.Signals(-self.code).name)
        return f"{how} after {self.seconds:.1f} s" + (f": {self.errors.strip()}" if self.errors else "")


class Running:
    """One process. Its stderr goes to a file, so that no pipe can hold it up."""

    def __init__(self, words, environment=None):
        self.errors = tempfile.TemporaryFile()
        self.start = time.monotonic()
        self.process = subprocess.Popen(
            [str(w) for w in words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=self.errors, env={**os.environ, **(environment or {})})
        self.pid = self.process.pid
        self.ended = None
        self.handle = os.pidfd_open(self.pid)

    def wait(self, seconds):
        """How it ended, or None if it still runs after so many seconds."""
        if self.ended is None:
            poll = select.poll()
            poll.register(self.handle, select.POLLIN)
            if not poll.poll(max(0.0, 1000 * seconds)):
                return None
            _, status, usage = os.wait4(self.pid, 0)
            seconds = time.monotonic() - self.start
            self.process.returncode = os.waitstatus_to_exitcode(status)
            os.close(self.handle)
            self.errors.seek(0)
            text = self.errors.read().decode(errors="replace")
            self.errors.close()
            self.ended = Ended(self.process.returncode, seconds, usage.ru_utime + usage.ru_stime,
                               1024 * usage.ru_maxrss, text, False)
        return self.ended

    def send(self, number):
        if self.ended is None:
            os.kill(self.pid, number)

    def finish(self, limit):
        """Waits to the end; a run beyond the limit is killed and called hung."""
        ended = self.wait(limit)
        if ended is None:
            self.send(signal.SIGKILL)
            ended = self.wait(60)
            ended.hung = True
        return ended


@dataclass
class Reference:
    """The undisturbed run of a case."""
    ended: Ended
    files: dict
    facts: dict
    stages: list = field(default_factory=list)

    @property
    def seconds(self):
        return self.ended.seconds

    @property
    def limit(self):
        """A run longer than this hangs."""
        return 60 + 20 * self.seconds


class Bench:
    """Folders, references and the rattan to run. Everything random comes from `random`."""

    def __init__(self, rattan, scratch, random, log):
        self.rattan = str(Path(rattan).resolve())
        self.scratch = Path(scratch)
        self.random = random
        self.log = log
        self.references = {}
        self.made = 0

    def folder(self):
        self.made += 1
        path = self.scratch / f"run{self.made}"
        path.mkdir()
        return path

    def words(self, case, folder, *more):
        return [self.rattan, case.command, case.scan, "-o", folder / case.output, "--quiet", "--report",
                folder / "report.json", *case.options, *more]

    def start(self, case, folder, *more, environment=None):
        often = {"RATTAN_CHECKPOINT_SECONDS": "0"} if case.often else {}
        return Running(self.words(case, folder, *more), {**often, **(environment or {})})

    def run(self, case, folder, *more, environment=None, limit=None):
        limit = limit or self.reference(case).limit  # before the start: the undisturbed run comes first
        return self.start(case, folder, *more, environment=environment).finish(limit)

    def synth(self, name, triangles, *more):
        path = self.scratch / f"{name}.ply"
        if not path.exists():
            subprocess.run([self.rattan, "synth", "-o", path, "--triangles", str(triangles), "--quiet",
                            *more], check=True)
        return path

    def reference(self, case):
        key = key_of(case)
        if key not in self.references:
            folder = self.folder()
            ended = Running(self.words(case, folder)).finish(3600)
            if ended.code != DONE:
                raise RuntimeError(f"{case.name}: the undisturbed run failed: {ended}")
            report = json.loads((folder / "report.json").read_text())
            self.references[key] = Reference(ended, outputs(folder), facts(folder), report["stages"])
            shutil.rmtree(folder)
            self.log(f"{case.name}: undisturbed {ended.seconds:.1f} s")
        return self.references[key]


def key_of(case):
    """What decides the undisturbed bytes: checkpoints change none."""
    return case.command, case.scan, case.options, case.output


def digest(path):
    """SHA-256, read in blocks: what this process holds counts for what it starts."""
    total = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            total.update(block)
    return total.hexdigest()


def is_work(name):
    return name.endswith(".work")


def work_folder(folder):
    """The work directory there, or None."""
    found = [p for p in folder.iterdir() if is_work(p.name)]
    return found[0] if found else None


def outputs(folder):
    """Of every file there but the report: name -> digest. Hidden leftovers count."""
    return {p.name: digest(p) for p in sorted(folder.iterdir())
            if p.name != "report.json" and not is_work(p.name)}


def facts(folder):
    """What a report says of the scan and the mesh, not of how it was made."""
    text = (folder / "report.json").read_text().replace(f"{folder}/", "FOLDER/")
    report = json.loads(text)
    return {name: report.get(name) for name in
            ("input", "options", "output", "outputs", "base_complex", "singularities", "distance",
             "charts", "distortion")}


def resumed_stages(folder):
    try:
        report = json.loads((folder / "report.json").read_text())
    except (OSError, ValueError):
        return 0
    return sum(bool(stage["resumed"]) for stage in report["stages"])
