#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Remeshes six public models at the face counts of Instant Meshes and compares figure by figure.

    RATTAN=build/release/rattan RATTAN_DATA=FOLDER tests/quality/compare_with_instant_meshes.py
    ... compare_with_instant_meshes.py --only koala,fandisk --json figures.json -- --curl-correction
    ... compare_with_instant_meshes.py --scans a.ply:5000 b.obj -- --density 4

What follows `--` goes to `rattan remesh`. `--scans` measures other files, FILE[:FACES] (else 0.05
faces a triangle): no bars apply there. Exit code: 0 if every bar holds or none applies, 1 if one
doesn't, 2 if a run failed.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

# Figure: bar of the median of ours / theirs; less is better in all of them. quad_shortfall and jacobian_shortfall
# are 1 - share of quads and 1 - mean scaled Jacobian.
BARS = {
    "quad_shortfall": 0.5,
    "irregular_share": 0.8,
    "jacobian_shortfall": 1.0,
    "corner_deviation": 1.0,
    "edge_variation": 1.0,
    "mean_to_scan": 1.0,
    "p99_from_scan": 1.0,
    "max_from_scan": 1.0,
}
FACES_WITHIN = 0.15

# Instant Meshes, the authors' program of "Instant Field-Aligned Meshes" (Jakob, Tarini, Panozzo,
# Sorkine-Hornung 2015), quad-dominant and deterministic (-D), at the face counts it arrived at:
# faces, quads in %, irregular interior vertices in %, mean scaled Jacobian, mean corner deviation in
# degrees, edge-length variation, then in % of the scan's diagonal: mean distance to the scan, 99th
# percentile and maximum of scan to remesh. With its crease option fandisk has a mean of .058 and a
# maximum of .47.
INSTANT_MESHES = {
    "nefertiti.obj": (4975, 96.0, 4.8, 0.988, 3.3, 0.08, 0.026, 0.35, 1.21),
    "koala.obj": (4998, 96.1, 5.3, 0.985, 3.4, 0.09, 0.037, 0.30, 1.12),
    "bun_zipper.ply": (3593, 95.3, 5.8, 0.981, 4.0, 0.09, 0.057, 0.47, 1.78),
    "gargoyle.obj": (2467, 91.1, 13.2, 0.953, 6.3, 0.12, 0.127, 1.12, 1.96),
    "rocker-arm.obj": (1003, 92.6, 11.0, 0.978, 4.7, 0.10, 0.143, 0.76, 1.77),
    "fandisk.obj": (636, 95.0, 11.0, 0.975, 5.0, 0.11, 0.131, 1.58, 3.32),
}


def their_figures(row):
    faces, quads, irregular, jacobian, corner, variation, mean, p99, largest = row
    return {"faces": faces, "quad_shortfall": 1 - quads / 100, "irregular_share": irregular / 100,
            "jacobian_shortfall": 1 - jacobian, "corner_deviation": corner,
            "edge_variation": variation, "mean_to_scan": mean, "p99_from_scan": p99,
            "max_from_scan": largest}


def our_figures(comparison):
    r, d = comparison["remesh"], comparison["distance"]
    return {"faces": r["faces"], "quad_shortfall": 1 - r["quad_share"],
            "irregular_share": r["irregular_share"],
            "jacobian_shortfall": 1 - r["mean_scaled_jacobian"],
            "corner_deviation": r["mean_corner_deviation"],
            "edge_variation": r["edge_length_variation"],
            "mean_to_scan": d["remesh_to_scan"]["mean"],
            "p99_from_scan": d["scan_to_remesh"]["p99"],
            "max_from_scan": d["scan_to_remesh"]["max"]}


def call(words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode:
        sys.stdout.flush()
        print(f"{' '.join(map(str, words))}: exit {done.returncode}: {done.stderr.strip()}",
              file=sys.stderr)
        sys.exit(2)


def measure(args, scan, faces, folder):
    out, report, figures = (Path(folder) / (scan.name + end) for end in (".drc", ".report", ".json"))
    size = ["--faces", faces] if faces else ["--ratio", 0.05]
    call([args.rattan, "remesh", scan, "-o", out, "--quiet", "--report", report, *size,
          *args.remesh])
    call([args.comparer or args.rattan, "compare", out, scan, "--quiet", "--json", figures])
    report, comparison = json.loads(report.read_text()), json.loads(figures.read_text())
    found = our_figures(comparison)
    notes = {"target_met": report["output"]["target_met"],
             "same_topology": comparison["same_topology"],
             "defects": {k: v for k, v in comparison["remesh"]["defects"].items() if v},
             "min_scaled_jacobian": comparison["remesh"]["min_scaled_jacobian"],
             "cpu_seconds": sum(s["cpu_seconds"] for s in report["stages"])}
    return found, notes, comparison


SHORT = {"quad_shortfall": "1-Q", "irregular_share": "irr", "jacobian_shortfall": "1-J",
         "corner_deviation": "ang", "edge_variation": "cv", "mean_to_scan": "o2i mean",
         "p99_from_scan": "i2o p99", "max_from_scan": "i2o max"}


def line(name, who, values):
    text = f"{name:<20} {who:<7}"
    faces = values.get("faces")
    text += " " * 8 if faces is None else f"{faces:8.0f}" if faces > 3 else f"{faces:8.2f}"
    return text + "".join(f"{values[k]:9.4f}" if k in values else " " * 9 for k in BARS)


def header():
    return " " * 28 + "   faces" + "".join(f"{SHORT[k]:>9}" for k in BARS)


def ratios_of(ours, theirs):
    return {k: ours[k] / theirs[k] for k in ("faces", *BARS)}


def faults(notes):
    text = []
    if not notes["same_topology"]:
        text.append("OTHER TOPOLOGY")
    if not notes["target_met"]:
        text.append("size missed")
    text += [f"{v} {k}" for k, v in notes["defects"].items()]
    return f"min J {notes['min_scaled_jacobian']:.2f}, {notes['cpu_seconds']:.2f} s cpu" + (
        "; " + ", ".join(text) if text else "")


def run_against_instant_meshes(args, folder):
    results, failed = {}, []
    print(header())
    for name in args.only or INSTANT_MESHES:
        theirs = their_figures(INSTANT_MESHES[name])
        scan = Path(args.data) / name
        if not scan.exists():
            sys.exit(f"{scan}: no such file. Give the models' folder by --data or RATTAN_DATA.")
        ours, notes, comparison = measure(args, scan, theirs["faces"], folder)
        ratios = ratios_of(ours, theirs)
        print(line(name, "ours", ours), " ", faults(notes))
        print(line("", "theirs", theirs))
        print(line("", "ratio", ratios), flush=True)
        results[name] = {"ours": ours, "theirs": theirs, "ratio": ratios, "notes": notes,
                         "compare": comparison}
        if abs(ratios["faces"] - 1) > FACES_WITHIN:
            failed.append(f"{name}: {ours['faces']} faces, not within {FACES_WITHIN:.0%}")
        if not notes["same_topology"] or notes["defects"]:
            failed.append(f"{name}: {faults(notes)}")
    medians = {k: statistics.median(r["ratio"][k] for r in results.values()) for k in BARS}
    print(line(f"median of {len(results)}", "ratio", medians))
    print(line("bar", "", BARS))
    holds = {k: medians[k] <= BARS[k] for k in BARS}
    failed += [f"{k}: median {medians[k]:.3f} above {BARS[k]}" for k in BARS if not holds[k]]
    print(f"bars held: {sum(holds.values())} of {len(holds)}")
    for f in failed:
        print("  FAILED", f)
    return {"files": results, "medians": medians, "bars": BARS, "holds": holds, "failed": failed}


def run_on_others(args, folder):
    results = {}
    print(header())
    for word in args.scans:
        path, _, faces = word.rpartition(":")
        scan, faces = (Path(path), int(faces)) if path and faces.isdigit() else (Path(word), None)
        ours, notes, comparison = measure(args, scan, faces, folder)
        print(line(scan.name, "ours", ours), " ", faults(notes), flush=True)
        results[str(scan)] = {"ours": ours, "notes": notes, "compare": comparison}
    return {"files": results, "failed": []}


def main():
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rattan", default=os.environ.get("RATTAN", "build/release/rattan"))
    parser.add_argument("--comparer", help="another rattan to compare with, where versions differ")
    parser.add_argument("--data", default=os.environ.get("RATTAN_DATA", "."))
    parser.add_argument("--only", type=lambda s: s.split(","), help="some of the six, by name")
    parser.add_argument("--scans", nargs="+", metavar="FILE[:FACES]")
    parser.add_argument("--json", help="write every figure there")
    parser.add_argument("--out", help="keep remeshes and reports in this folder")
    args = parser.parse_args(words[:split])
    args.remesh = words[split + 1:]
    if args.only:
        known = {Path(n).stem: n for n in INSTANT_MESHES} | {n: n for n in INSTANT_MESHES}
        unknown = [n for n in args.only if n not in known]
        if unknown:
            parser.error(f"{', '.join(unknown)}: not among {', '.join(INSTANT_MESHES)}")
        args.only = [known[n] for n in args.only]
    with tempfile.TemporaryDirectory(prefix="rattan-quality.") as scratch:
        folder = args.out or scratch
        os.makedirs(folder, exist_ok=True)
        results = (run_on_others if args.scans else run_against_instant_meshes)(args, folder)
    if args.json:
        Path(args.json).write_text(json.dumps(results, indent=2) + "\n")
    sys.exit(1 if results["failed"] else 0)


if __name__ == "__main__":
    main()
