# SPDX-License-Identifier: MIT
"""Work of another command in the way: interrupted with one set of options or one scan, resumed with
another. What comes out is what that other would have given by itself."""

import os
import shutil
from dataclasses import replace

from checks import expect_done, remove
from interrupted import interrupt
from program import key_of, outputs, resumed_stages

# Each as (first, second); the work directory is the same.
CHANGES = [
    (("--faces", "900"), ("--faces", "500")),
    (("--faces", "900"), ("--ratio", "0.04")),
    (("--faces", "900"), ("--faces", "900,300")),
    (("--faces", "900,300"), ("--faces", "300")),
    (("--faces", "900"), ("--faces", "900", "--pure-quads")),
    (("--faces", "900"), ("--faces", "900", "--density", "2")),
    (("--faces", "900"), ("--faces", "900", "--symmetry", "2")),
    (("--faces", "900"), ("--faces", "900", "--smoothing", "0.9")),
    (("--faces", "900"), ("--faces", "900", "--crease", "off")),
    (("--faces", "900"), ("--faces", "900", "--curl-correction")),
    (("--faces", "900"), ("--faces", "900", "--energy", "edge")),
    (("--faces", "900"), ("--faces", "900", "--newton-steps", "2")),
    (("--faces", "900"), ("--faces", "900", "--position-bits", "12")),
    (("--faces", "900"), ("--faces", "900", "--fill-holes", "1000")),
    (("--faces", "900"), ("--faces", "900", "--drop-components", "50")),
    (("--faces", "900"), ("--faces", "900", "--threads", "1", "--memory", "512MiB")),
]

# Of `rattan layout`, likewise; with the names of the outputs.
LAYOUT_CHANGES = [
    (((), "out.obj"), (("--chart-size", "40"), "out.obj")),
    (((), "out.obj"), (("--atlas",), "out.obj")),
    (((), "out.obj"), (("--curl-correction",), "out.obj")),
    (((), "out.obj"), ((), "out.ply")),
    (((), "out.ply"), ((), "out.drc")),
    (((), "out.drc"), (("--position-bits", "12"), "out.drc")),
    (((), "out.obj"), (("--relax", "3"), "out.obj")),
    (((), "out.obj"), (("--symmetry", "2"), "out.obj")),
    (((), "out.obj"), (("--smoothing", "0.9"), "out.obj")),
    (((), "out.obj"), (("--energy", "edge"), "out.obj")),
    (((), "out.obj"), (("--newton-steps", "5"), "out.obj")),
    (((), "out.obj"), (("--fill-holes", "1000"), "out.obj")),
    (((), "out.obj"), (("--threads", "1", "--memory", "512MiB"), "out.obj")),
]


def resume_as(bench, tally, first, second, where, share):
    """Interrupted as `first`, resumed as `second`; both work in the same place."""
    folder = bench.folder()
    work = ("--work-dir", str(folder / "same.work"))
    where = f"{where} in {folder.name}"
    interrupt(bench, first, folder, share, more=work)
    for name in outputs(folder):  # those of the first command that were complete
        (folder / name).unlink()
    ended = bench.run(second, folder, *work)
    tally.count("changed commands")
    if expect_done(tally, bench, second, folder, ended, where):
        tally.count("stages resumed all the same", resumed_stages(folder))
        remove(folder)


def change_scan(source, target, keep_time):
    """Another scan of the same size: one digit of a coordinate differs."""
    text = bytearray(source.read_bytes())
    at = text.index(b".", text.index(b"\nv ", len(text) // 4)) + 1
    text[at] = ord("1") if text[at] != ord("1") else ord("2")
    times = target.stat() if keep_time else None
    target.write_bytes(text)
    if times:
        os.utime(target, ns=(times.st_atime_ns, times.st_mtime_ns))


def changed_scan(bench, tally, case, keep_time, share):
    """The scan changes under its name between the two runs."""
    folder = bench.folder()
    scan = folder.with_name(folder.name + "-scan" + case.scan.suffix)
    shutil.copyfile(case.scan, scan)
    first = replace(case, scan=scan)
    bench.reference(first)
    interrupt(bench, first, folder, share)
    change_scan(case.scan, scan, keep_time)
    bench.references.pop(key_of(first))
    second = replace(first, name=f"{case.name} with a changed digit")
    ended = bench.run(second, folder)
    tally.count("changed scans")
    if expect_done(tally, bench, second, folder, ended,
                   f"{second.name}{', file time kept' if keep_time else ''}, in {folder.name}"):
        remove(folder)


def run_layouts(bench, tally, case, changes):
    """`case` lays out; work of a remesh of its scan is in the way as well."""
    for first, second in LAYOUT_CHANGES[:changes]:
        for share in (0.5, 0.9) if changes == len(LAYOUT_CHANGES) else (0.8,):
            a, b = (replace(case, options=options, output=output) for options, output in (first, second))
            resume_as(bench, tally, a, b, f"{case.name}, {' '.join(first[0])} {first[1]} then "
                      f"{' '.join(second[0])} {second[1]}", share)
    remesh = replace(case, command="remesh", options=(), output="out.obj")
    resume_as(bench, tally, remesh, case, f"{case.name}, remesh then layout", 0.8)


def run(bench, tally, case, changes, text_case):
    for first, second in CHANGES[:changes]:
        for share in (0.5, 0.9) if changes == len(CHANGES) else (0.8,):
            resume_as(bench, tally, replace(case, options=first), replace(case, options=second),
                      f"{case.name}, {' '.join(first)} then {' '.join(second)}", share)
    other = replace(case, options=("--faces", "900"), output="out.obj")
    resume_as(bench, tally, replace(case, options=("--faces", "900")), other,
              f"{case.name}, .drc then .obj", 0.8)
    if text_case:
        for keep_time in (False, True):
            changed_scan(bench, tally, text_case, keep_time, 0.8)
