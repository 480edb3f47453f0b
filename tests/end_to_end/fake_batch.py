# SPDX-License-Identifier: MIT
"""The folder of a batch that never ran: journal, reports and pictures of as many scans as wanted."""

import json
import os
import random
from pathlib import Path

FOLDERS = ["statues", "reliefs/north wall", "coins", "architecture/capitals", "terrain"]
FAILURES = [
    (3, "the file ends after {} of 90000 vertices. Copy it again."),
    (3, "it has no triangles (a point cloud). Give a mesh."),
    (4, "a memory budget of 512 MiB is too small. At least {} MiB are needed."),
    (1, "A defect in Rattan: edge {} has three faces. Please report it with the scan."),
]


def make(directory, count, thumbnail, viewer, seed=7):
    """Eight workers, with an hour's rest in the middle; the pictures are links to those given."""
    chance = random.Random(seed)
    directory = Path(directory)
    (directory / ".rattan" / "journal").mkdir(parents=True)
    start = 1795368000.0
    clocks = [start] * 8
    lines = [{"event": "batch", "action": "begin", "time": start, "items": count, "total": count,
              "shard": 0, "shards": 0}]
    for i in range(count):
        name = f"{FOLDERS[i % len(FOLDERS)]}/scan-{i:05d}.drc"
        scan = f"/data/{name[:-4]}.ply"
        triangles = int(10 ** chance.uniform(4.3, 6.6))
        seconds = triangles / chance.uniform(80e3, 260e3)
        if i == count // 2:
            clocks = [max(clocks) + 3600.0] * 8
        worker = min(range(8), key=clocks.__getitem__)
        begun, clocks[worker] = clocks[worker], clocks[worker] + seconds
        code, sentence = 0, None
        if chance.random() < 0.026:
            code, sentence = chance.choice(FAILURES)
            sentence = f"{scan}: {sentence.format(chance.randint(600, 60000))}"
        who = {"id": name, "attempt": 1, "host": f"node{worker % 3 + 1}", "pid": 100 + worker}
        lines.append({"event": "start", "time": begun, "scan": scan, "options": ["--ratio", "0.05"],
                      **who})
        lines.append({"event": "end", "time": clocks[worker], "exit": code, "sentence": sentence,
                      "seconds": seconds, "cpu_seconds": 0.97 * seconds,
                      "peak_rss_bytes": int(6e7 + 60 * triangles), "warnings": 0,
                      "outputs": [] if code else [{"path": name, "bytes": triangles // 4}], **who})
        (directory / name).parent.mkdir(parents=True, exist_ok=True)
        if code:
            (directory / (name + ".log")).write_text(sentence + "\n", encoding="utf-8")
        else:
            folder = directory / "report" / name
            folder.mkdir(parents=True)
            report = figures(chance, scan, triangles)
            (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
            os.symlink(thumbnail, folder / "thumbnail.png")
            os.symlink(viewer, folder / "view.js")
    journal = directory / ".rattan" / "journal" / "node1-100-1.000000.jsonl"
    with open(journal, "w", encoding="utf-8") as file:
        for line in lines:
            file.write(json.dumps(line) + "\n")


def figures(chance, scan, triangles):
    faces = int(0.05 * triangles)
    diagonal = chance.uniform(50, 500)
    torn = chance.random() < 0.06
    return {
        "input": {"path": scan, "vertices": triangles // 2, "triangles": triangles,
                  "repaired": {"degenerate": chance.choice([0, 0, 0, 12, 4021]),
                               "non_manifold_edges": 3 if torn else 0}},
        "options": {"ratio": 0.05},
        "output": {"faces": faces, "quads": int(faces * chance.uniform(0.93, 0.999)),
                   "target_faces": 0.05 * triangles, "target_met": True,
                   "irregular_vertices": int(faces * chance.uniform(0.01, 0.04)),
                   "mean_scaled_jacobian": chance.uniform(0.9, 0.99)},
        "singularities": {"vertices": 0, "edges": 0, "triangles": int(0.02 * faces)},
        "distortion": {"stretch": chance.uniform(1.01, 1.1), "shear": chance.uniform(0.03, 0.1)},
        "distance": {"to_input_max": diagonal * chance.uniform(0.001, 0.006),
                     "to_input_rms": diagonal * chance.uniform(0.0001, 0.0006),
                     "from_input_max": diagonal * chance.uniform(0.001, 0.009),
                     "from_input_rms": diagonal * chance.uniform(0.0001, 0.0006),
                     "diagonal": diagonal},
        "warnings": [f"{scan}: 3 edges with more than two faces were cut apart."] if torn else [],
    }
