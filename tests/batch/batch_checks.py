# SPDX-License-Identifier: MIT
"""What tests of batches share: reading journals, and what must hold of them."""

import hashlib
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "end_to_end"))

FAR_TOO_LONG = 600


def journal(directory):
    """All records, by file, in the order of writing; torn lines left out."""
    for file in sorted((Path(directory) / ".rattan" / "journal").glob("*.jsonl")):
        for line in file.read_bytes().split(b"\n"):
            try:
                yield json.loads(line)
            except ValueError:
                continue


def attempts(directory):
    """{id: [(start, end or None), ...] by number}"""
    found = {}
    for record in journal(directory):
        if record["event"] in ("start", "end"):
            pair = found.setdefault(record["id"], {}).setdefault(record["attempt"], {})
            if record["event"] in pair:
                raise AssertionError(f"{record['id']}: attempt {record['attempt']} has two "
                                     f"{record['event']} records")
            pair[record["event"]] = record
    return {name: [(pair.get("start"), pair.get("end")) for _, pair in sorted(pairs.items())]
            for name, pairs in found.items()}


def check_nothing_twice(directory):
    """What was done for a scan and options is never begun again. Returns the numbers of starts, of
    ends, and of ends that were found later."""
    starts = ends = adopted = 0
    for name, tries in attempts(directory).items():
        done = None
        for number, (start, end) in enumerate(tries, 1):
            if start is None or start["attempt"] != number:
                raise AssertionError(f"{name}: attempt {number} has no start")
            what = (start["key"], start["scan_bytes"], start["scan_time"])
            if what == done:
                raise AssertionError(f"{name}: attempt {number} made again what was done")
            starts += 1
            if end is not None:
                ends += 1
                adopted += "adopted" in end
                if end["exit"] == 0:
                    done = what
    return starts, ends, adopted


def last_exits(directory):
    """{id: exit of the last attempt, None if it has no end}"""
    return {name: tries[-1][1]["exit"] if tries[-1][1] else None
            for name, tries in attempts(directory).items()}


def digest(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def outputs(directory):
    """{id: digest} of the files that are remeshes."""
    directory = Path(directory)
    return {str(p.relative_to(directory)): digest(p) for p in sorted(directory.rglob("*"))
            if p.is_file() and p.suffix in (".drc", ".obj", ".ply", ".off")
            and not {".rattan", "report"} & set(p.relative_to(directory).parts[:-1])}


def leftovers(directory):
    """Files and folders that a finished batch should have removed."""
    directory = Path(directory)
    return [str(p) for p in directory.rglob("*")
            if p.name.endswith((".work", ".partial"))
            or (p.parent.parent.name == ".rattan" and p.parent.name == "claims")]


def children_of(pid):
    """Process ids of the children of a process that live."""
    try:
        return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def tree_rss(pid):
    """Bytes that a process and its children fill now."""
    total = 0
    for p in [pid, *children_of(pid)]:
        try:
            for line in Path(f"/proc/{p}/status").read_text().splitlines():
                if line.startswith("VmRSS:"):
                    total += int(line.split()[1]) * 1024
        except OSError:
            pass
    return total
