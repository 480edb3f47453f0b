#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The fault suite: whatever happens to a run, the next one ends with the undisturbed bytes.

    tests/fault/run.py build/release/rattan [--short] [--kills 200] [--seed 1] [--only kills,disk]

Reads RATTAN_DATA (a folder of sample scans) where it is set; the other scans are synthesised. Prints
what was done and found by section; exit code 1 if anything failed. See README.md beside.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

sys.dont_write_bytecode = True

import agreement
import damage
import disk
import kills
import locks
import power
import stale
import stops
import writes
from checks import Skip, Tally
from program import Bench, Case

SECTIONS = ("kills", "power", "disk", "writes", "damage", "stale", "signals", "locks", "bytes", "memory")
IN_A_NAMESPACE = "RATTAN_FAULT_NAMESPACE"


def own_mounts():
    """Starts again in a mount namespace of its own, where that is allowed: what is mounted for a test is
    gone with it, and no root is needed."""
    if os.environ.get(IN_A_NAMESPACE) or not shutil.which("unshare"):
        return
    for words in (["unshare", "--mount"], ["unshare", "--mount", "--user", "--map-root-user"]):
        if subprocess.run([*words, "true"], capture_output=True).returncode == 0:
            os.environ[IN_A_NAMESPACE] = "1"
            os.execvp(words[0], [*words, sys.executable, *sys.argv])


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rattan")
    parser.add_argument("--short", action="store_true", help="a few of each on small scans, under a minute")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default=",".join(SECTIONS), help="sections: " + " ".join(SECTIONS))
    parser.add_argument("--large", type=int, default=6_400_000,
                        help="triangles of the largest scan that is interrupted")
    parser.add_argument("--scratch", help="folder for everything; default a temporary one")
    parser.add_argument("--keep", action="store_true", help="leave the folders of runs that failed")
    result = parser.parse_args()
    unknown = set(result.only.split(",")) - set(SECTIONS)
    if unknown:
        parser.error(f"no such section: {', '.join(sorted(unknown))}")
    return result


class Scans:
    """The scans, made when first asked for."""

    def __init__(self, bench):
        self.bench = bench
        self.data = os.environ.get("RATTAN_DATA")

    def sample(self, name):
        """A sample scan, or a synthetic one in its place."""
        if self.data:
            return Path(self.data) / name
        genus = len(name) % 4
        return self.synth(20_000 + 1_000 * len(name), genus)

    def synth(self, triangles, genus=1, holes=2):
        return self.bench.synth(f"synth-{triangles}-{genus}-{holes}", triangles, "--genus", str(genus),
                                "--holes", str(holes))

    def coloured(self, side=90):
        """Hills with a colour at each vertex."""
        path = self.bench.scratch / f"coloured-{side}.obj"
        if not path.exists():
            lines = [f"v {x / 10!r} {y / 10!r} {(x * x % 13 + y * y % 7) / 80 + 0.125!r} "
                     f"{x / side!r} {y / side!r} {(x + 2 * y) % 17 / 17!r}"
                     for y in range(side) for x in range(side)]
            path.write_text("\n".join(lines + self.sheet(side)) + "\n")
        return path

    @staticmethod
    def sheet(side):
        """Triangles of side x side vertices."""
        lines = []
        for y in range(1, side):
            for x in range(1, side):
                a, b = (y - 1) * side + x, y * side + x
                lines += [f"f {a} {a + 1} {b + 1}", f"f {a} {b + 1} {b}"]
        return lines

    def text(self):
        """A small scan as text."""
        path = self.bench.scratch / "text.obj"
        if not path.exists():
            side = 70
            lines = [f"v {x / 10!r} {y / 10!r} {(x * x % 13 + y * y % 7) / 50 + 0.125!r}"
                     for y in range(side) for x in range(side)]
            path.write_text("\n".join(lines + self.sheet(side)) + "\n")
        return path


def short_plan(bench, scans, tally):
    small = Case("20k", scans.synth(20_000))
    quads = Case("20k in quads", scans.synth(20_000), ("--faces", "400", "--pure-quads"), "out.obj")
    several = Case("20k in sizes", scans.synth(20_000), ("--faces", "1k,200"), "out.ply")
    layout = Case("8k in charts", scans.synth(8_000), (), "out.obj", command="layout")
    baked = Case("3k in charts, baked", scans.coloured(40), ("--bake", "128"), "out.obj", command="layout")

    def stale_work():
        counts = tally("stale")
        stale.run(bench, counts, small, 2, None)
        stale.run_layouts(bench, counts, layout, 2)

    return {
        "kills": lambda: kills.run(bench, tally("kills"), [
            (small, 2), (quads, 1), (several, 1), (layout, 1), (baked, 1)], 14),
        "power": lambda: power.run(bench, tally("power"), [small, several, baked], 9),
        "disk": lambda: disk.run(bench, tally("disk"), [small, baked], 6),
        "writes": lambda: writes.run(bench, tally("writes"), [small, baked], 16),
        "damage": lambda: damage.run(bench, tally("damage"), [small, layout], 22, 10),
        "stale": stale_work,
        "signals": lambda: stops.run(bench, tally("signals"), [(small, 3), (layout, 2)]),
        "locks": lambda: locks.run(bench, tally("locks"), small, 1),
        "bytes": lambda: agreement.same_bytes(bench, tally("bytes"), [small, baked]),
        "memory": lambda: agreement.memory_bound(bench, tally("memory"), [
            (small, ["128MiB", "256MiB"]), (layout, ["128MiB"])]),
    }


class Layouts:
    """The cases of `rattan layout` in the long form."""

    def __init__(self, scans):
        def case(name, scan, options=(), output="out.obj", **more):
            return Case(f"{name} in charts", scan, options, output, command="layout", **more)

        self.holes = case("3holes", scans.sample("3holes.off"), (), "out.drc")
        self.koala = case("koala", scans.sample("koala.obj"), (), "out.ply")
        self.bunny = case("bun_zipper", scans.sample("bun_zipper.ply"), ("--curl-correction",))
        self.plane = case("plane_holes", scans.sample("plane_holes.obj"), ("--atlas",), "out.drc")
        self.baked = case("coloured", scans.coloured(), ("--bake", "512"))
        self.small = case("8k", scans.synth(8_000))
        self.middle = case("400k", scans.synth(400_000), ("--memory", "192MiB"), "out.ply", often=False)
        self.big = case("1.6M", scans.synth(1_600_000), ("--memory", "192MiB"), "out.ply", often=False)
        self.all_small = [self.holes, self.plane, self.baked, self.small]


def full_plan(bench, scans, tally, options):
    koala = Case("koala", scans.sample("koala.obj"))
    holes = Case("3holes", scans.sample("3holes.off"), ("--faces", "900"))
    sizes = Case("nefertiti in sizes", scans.sample("nefertiti.obj"), ("--faces", "8k,2k,700"), "out.obj")
    quads = Case("bun_zipper in quads", scans.sample("bun_zipper.ply"), ("--pure-quads",))
    plane = Case("plane_holes", scans.sample("plane_holes.obj"), (), "out.off")
    middle = Case("400k", scans.synth(400_000), ("--memory", "256MiB"), "out.ply", often=False)
    small = Case("100k", scans.synth(100_000, 3), ("--threads", "1"))
    big = Case("1.6M", scans.synth(1_600_000), ("--faces", "30k", "--memory", "256MiB"), often=False)
    big_fine = Case("1.6M fine", scans.synth(1_600_000), ("--faces", "200k"), often=False)

    def largest():
        return Case(f"{options.large / 1e6:.1f}M", scans.synth(options.large), ("--faces", "200k"),
                    often=False)

    agree = [Case(Path(n).stem, scans.sample(n)) for n in
             ("koala.obj", "nefertiti.obj", "gargoyle.obj", "bun_zipper.ply", "plane_holes.obj")]
    layouts = Layouts(scans)

    def stale_work():
        counts = tally("stale")
        stale.run(bench, counts, Case("3holes", holes.scan), len(stale.CHANGES),
                  Case("text", scans.text(), ("--faces", "600",)))
        stale.run_layouts(bench, counts, layouts.small, len(stale.LAYOUT_CHANGES))

    return {
        "kills": lambda: kills.run(bench, tally("kills"), [
            (koala, 30), (holes, 30), (sizes, 30), (quads, 25), (plane, 25), (small, 25), (middle, 20),
            (big, 15), (layouts.holes, 20), (layouts.koala, 15), (layouts.bunny, 15), (layouts.plane, 15),
            (layouts.baked, 20), (layouts.small, 15), (layouts.middle, 10)], options.kills),
        "power": lambda: power.run(bench, tally("power"), [
            holes, koala, plane, small, sizes, *layouts.all_small], 90),
        "disk": lambda: disk.run(bench, tally("disk"), [
            koala, small, middle, layouts.koala, layouts.baked, layouts.plane], 40),
        "writes": lambda: writes.run(bench, tally("writes"), [
            holes, small, sizes, layouts.holes, layouts.baked], 140),
        "damage": lambda: damage.run(bench, tally("damage"), [
            holes, small, sizes, layouts.koala, layouts.baked], 450, 140),
        "stale": stale_work,
        "signals": lambda: stops.run(bench, tally("signals"), [
            (holes, 6), (middle, 20), (big_fine, 20), (largest(), 10), (layouts.koala, 8),
            (layouts.middle, 12), (layouts.big, 10)]),
        "locks": lambda: locks.run(bench, tally("locks"), middle, 6),
        "bytes": lambda: agreement.same_bytes(
            bench, tally("bytes"), [*agree, Case("1.6M", scans.synth(1_600_000), ("--faces", "30k")),
                                    *layouts.all_small, layouts.koala, layouts.bunny, layouts.big]),
        "memory": lambda: agreement.memory_bound(bench, tally("memory"), [
            (koala, ["128MiB", "256MiB"]),
            (Case("1.6M", scans.synth(1_600_000), ("--faces", "20k",)), ["256MiB", "512MiB", "1GiB"]),
            (Case("1.6M fine", scans.synth(1_600_000), ("--faces", "200k",)), ["1GiB", "2GiB"]),
            (Case("1.6M in quads", scans.synth(1_600_000), ("--faces", "20k", "--pure-quads")), ["512MiB"]),
            (largest(), ["1GiB", "2GiB"]),
            (layouts.koala, ["96MiB", "256MiB"]),
            (replace(layouts.big, options=()), ["192MiB", "256MiB", "1GiB"])]),
    }


def main():
    options = arguments()
    own_mounts()
    scratch = Path(options.scratch or tempfile.mkdtemp(prefix="rattan-fault.")).resolve()
    scratch.mkdir(exist_ok=True, parents=True)
    begin = time.monotonic()

    def log(sentence):
        print(f"{time.monotonic() - begin:7.1f} s  {sentence}", flush=True)

    tallies = []
    stopped = []

    def stop(number, _frame):
        stopped.append(number)
        raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)

    def tally(name):
        tallies.append(Tally(name, log))
        return tallies[-1]

    # Each section draws its own numbers, so that one alone repeats what it does among all.
    bench = Bench(options.rattan, scratch, None, log)
    scans = Scans(bench)
    if not scans.data:
        log("RATTAN_DATA is not set: synthetic scans alone")
    plan = short_plan(bench, scans, tally) if options.short else full_plan(bench, scans, tally, options)
    for name in SECTIONS:
        if name not in options.only.split(","):
            continue
        bench.random = random.Random(f"{options.seed} {name}")
        start = time.monotonic()
        before = len(tallies)
        try:
            plan[name]()
        except Skip as reason:
            tallies[-1].skipped = str(reason)
        except KeyboardInterrupt:
            if len(tallies) == before:
                tally(name)
            tallies[-1].fail("stopped before its end")
        except Exception as error:  # the suite's own mistake, or a scan that can't be made at all
            if len(tallies) == before:
                tally(name)
            tallies[-1].fail(f"{type(error).__name__}: {error}")
        log(f"{name}: {time.monotonic() - start:.0f} s; {tallies[-1].summary()}")
        if stopped:
            break

    failures = sum(len(t.failures) for t in tallies)
    print(f"\nseed {options.seed}, {time.monotonic() - begin:.0f} s")
    for t in tallies:
        print(f"  {t.name:8} {'FAILED' if t.failures else 'ok':7}{t.summary()}")
        for sentence in t.failures:
            print(f"      {sentence}")
    print(f"{failures} failures")
    if options.keep and failures:
        print(f"folders of the failures: {scratch}")
    elif not options.scratch:
        shutil.rmtree(scratch, ignore_errors=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
