# SPDX-License-Identifier: MIT
"""A Slurm of its own for a test, brought up by slurm-local (RATTAN_SLURM_LOCAL names it)."""

import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

NODES = 3


def why_not():
    """What is missing for a cluster; None if nothing is."""
    program = os.environ.get("RATTAN_SLURM_LOCAL", "")
    if not program:
        return "RATTAN_SLURM_LOCAL isn't set: it names slurm-local, which starts a Slurm for tests"
    if not os.access(program, os.X_OK):
        return f"RATTAN_SLURM_LOCAL={program} can't be run"
    if os.geteuid() != 0:
        return "a Slurm for tests wants root"
    installed = subprocess.run([program, "install"], capture_output=True, text=True, timeout=600)
    if installed.returncode != 0:
        return f"Slurm can't be installed: {installed.stderr.strip()}"
    return None


def free_ports():
    """A base below which no port is taken; SLURM_LOCAL_PORT if given."""
    if "SLURM_LOCAL_PORT" in os.environ:
        return int(os.environ["SLURM_LOCAL_PORT"])
    for base in range(17000, 30000, 100):
        try:
            for port in range(base, base + 11 + NODES):
                with socket.socket() as probe:
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    probe.bind(("127.0.0.1", port))
            return base
        except OSError:
            continue
    raise RuntimeError("no free ports for a cluster")


class Cluster:
    """n1, n2 and n3, with four processors and 4000 MB each on paper."""

    def __init__(self):
        self.program = os.environ["RATTAN_SLURM_LOCAL"]
        self.folder = Path(tempfile.mkdtemp(prefix="rattan-slurm."))
        environment = dict(os.environ, SLURM_LOCAL_PORT=str(free_ports()),
                           SLURM_LOCAL_NODES=str(NODES))
        started = subprocess.run([self.program, "start", str(self.folder)], env=environment,
                                 capture_output=True, text=True, timeout=120)
        if started.returncode != 0:
            self.stop()
            raise RuntimeError(started.stderr)
        self.environment = dict(
            environment, SLURM_CONF=re.search(r"SLURM_CONF=(\S+)", started.stdout)[1])

    def stop(self):
        subprocess.run([self.program, "stop", str(self.folder)], capture_output=True, timeout=120,
                       check=False)
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, *words, code=0, **more):
        done = subprocess.run([str(w) for w in words], env=self.environment, capture_output=True,
                              text=True, timeout=300, **more)
        if code is not None and done.returncode != code:
            raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def crash(self, node, what=None):
        self.run(self.program, "crash", self.folder, node, *([what] if what else []))

    def boot(self, node):
        self.run(self.program, "boot", self.folder, node)

    def queue(self):
        """{"12_3": "RUNNING", "13": "PENDING"}: all that is queued or at work."""
        lines = self.run("squeue", "-h", "-r", "-o", "%i %T").splitlines()
        return dict(line.split() for line in lines)

    def node_of(self, task):
        return self.run("squeue", "-h", "-r", "-j", task, "-o", "%N", code=None).strip()

    def field(self, job, name):
        """Values of a field of a job's tasks, e.g. Restarts."""
        text = self.run("scontrol", "show", "job", "-o", job)
        return re.findall(rf"\b{name}=(\S*)", text)

    def wait(self, what, condition, seconds=120):
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"waited {seconds} s for {what}; queue {self.queue()}")
            time.sleep(0.2)

    def wait_until_empty(self, seconds=300):
        self.wait("an empty queue", lambda: not self.queue(), seconds)
