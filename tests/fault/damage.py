# SPDX-License-Identifier: MIT
"""Damaged work: a flipped byte, a zeroed block, a file cut short, grown, missing or another's. Interrupted
work is damaged and resumed; kept work is damaged and looked at. It is found and rebuilt, or harmless."""

import os
import shutil

from checks import expect_done, remove
from interrupted import copy, snapshots, store_files
from program import DONE, REFUSED_INPUT, Running, work_folder

HOW = ("flip",) * 12 + ("zero block", "cut", "cut", "grow", "delete", "swap", "empty")


def pick_offset(random, size):
    """Half anywhere, half where the structure of a file is thick: its ends."""
    if random.random() < 0.5:
        return random.randrange(size)
    near = random.randrange(min(size, 4096))
    return near if random.random() < 0.5 else size - 1 - near


def damage(random, files, how):
    """Returns the damaged file and a description."""
    by_size = random.choices(files, [p.stat().st_size for p in files])[0]
    path = random.choice([by_size, random.choice(files)])
    size = path.stat().st_size
    at = pick_offset(random, size)
    if how == "flip":
        mask = random.choice([1 << random.randrange(8), 0xFF])
        with open(path, "r+b") as file:
            file.seek(at)
            byte = file.read(1)[0]
            file.seek(at)
            file.write(bytes([byte ^ mask]))
        return path, f"byte {at} of {path.name} ^ {mask:#x}"
    if how == "zero block":
        with open(path, "r+b") as file:
            file.seek(at // 4096 * 4096)
            file.write(bytes(min(4096, size - at // 4096 * 4096)))
        return path, f"zeros at {at // 4096 * 4096} of {path.name}"
    if how == "cut":
        os.truncate(path, at)
        return path, f"{path.name} cut to {at} of {size} bytes"
    if how == "grow":
        with open(path, "ab") as file:
            file.write(random.randbytes(random.randint(1, 5000)))
        return path, f"{path.name} grown"
    if how == "delete":
        path.unlink()
        return path, f"{path.name} deleted"
    if how == "empty":
        os.truncate(path, 0)
        return path, f"{path.name} emptied"
    other = random.choice(files)
    if other == path:
        path.write_bytes(b"")
    else:
        shutil.copyfile(other, path)
    return path, f"{path.name} replaced by {other.name}"


def damage_and_resume(bench, tally, case, snapshot):
    random = bench.random
    folder = copy(bench, snapshot)
    files = store_files(folder)
    how = random.choice(HOW)
    path, what = damage(random, files, how)
    where = f"{case.name} in {folder.name}, {what}"
    ended = bench.run(case, folder)
    tally.count(f"damages ({how})")
    ok = expect_done(tally, bench, case, folder, ended, where)
    named = path.name in ended.errors or path.stem in ended.errors
    tally.count("not rebuilt" if not ok else "found, named and rebuilt" if named else
                "without a word and harmless")
    if ok:
        remove(folder)


def damage_and_look(bench, tally, case, snapshot):
    """`rattan info` of damaged work: an answer or a sentence."""
    folder = copy(bench, snapshot)
    _, what = damage(bench.random, store_files(folder), bench.random.choice(HOW))
    ended = Running([bench.rattan, "info", work_folder(folder)]).finish(60)
    tally.count("looks at damaged work")
    tally.count("looks that told of damage", ended.code == REFUSED_INPUT)
    if tally.expect(ended.code in (DONE, REFUSED_INPUT), f"{case.name} in {folder.name}, info, {what}: {ended}"):
        remove(folder)


def run(bench, tally, cases, trials, looks):
    scenes = []
    for case in cases:
        made = snapshots(bench, case, (0.55, 0.75, 0.9))
        tally.expect(made, f"{case.name}: an interrupted run leaves nothing to resume from")
        scenes += [(case, folder) for folder in made]
    for case, folder in scenes:
        tally.log(f"damage: {case.name}: " + ", ".join(
            f"{p.name} {p.stat().st_size}" for p in store_files(folder)))
    for k in range(trials if scenes else 0):
        damage_and_resume(bench, tally, *scenes[k % len(scenes)])
    for k in range(looks if scenes else 0):
        damage_and_look(bench, tally, *scenes[k % len(scenes)])
    for _, folder in scenes:
        remove(folder)
