# SPDX-License-Identifier: MIT
"""The preloaded shim (fault_shim.c): making it, asking it for faults, reading its log.

A line of the log is `KIND inode number length path`. W data written at an offset (the number), T size
set, S synced, C file made, M folder made, R renamed (path, tab, new path) over the file whose grave has
that number, U removed into that grave, D folder removed. A call is noted before it is done, but S, C and M
after."""

import os
import shutil
import subprocess
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from checks import Skip

KINDS = {"W": "write", "T": "truncate", "S": "sync", "R": "rename", "C": "open", "U": "unlink",
         "D": "unlink"}


@dataclass
class Call:
    kind: str
    inode: int
    number: int
    length: int
    path: Path
    target: Path = None


def build_shim(scratch):
    """Path of the compiled shim; raises Skip where there is no C compiler."""
    shim = Path(scratch) / "fault_shim.so"
    if not shim.exists():
        compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")
        if not compiler:
            raise Skip("no C compiler")
        source = Path(__file__).with_name("fault_shim.c")
        made = subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", shim, source, "-ldl", "-lpthread"],
                              capture_output=True, text=True)
        if made.returncode != 0:
            raise Skip(f"{source.name} doesn't compile here: {made.stderr.strip().splitlines()[-1:]}")
    return shim


def environment(shim, under, on="", at=0, do=0, sticky=False, log=None, graves=None):
    result = {"LD_PRELOAD": str(shim), "FAULT_UNDER": str(under), "FAULT_ON": on, "FAULT_AT": str(at),
              "FAULT_DO": str(do), "FAULT_STICKY": "1" if sticky else ""}
    if log:
        result["FAULT_LOG"] = str(log)
    if graves:
        result["FAULT_GRAVES"] = str(graves)
    return result


def read_log(log):
    result = []
    for line in Path(log).read_text(errors="replace").splitlines():
        kind, inode, number, length, path = line.split(" ", 4)
        path, _, target = path.partition("\t")
        result.append(Call(kind, int(inode), int(number), int(length), Path(path),
                           Path(target) if target else None))
    return result


def count_kinds(calls):
    """How often a run made each kind of call that FAULT_ON knows."""
    return Counter(KINDS[c.kind] for c in calls if c.kind in KINDS)
