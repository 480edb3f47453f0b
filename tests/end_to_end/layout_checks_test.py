# SPDX-License-Identifier: MIT
"""The checks of layouts find what is wrong, and nothing where nothing is."""

import copy
import unittest

import layout_checks
from layout_checks import Layout

CUBE = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def prism(n):
    """Closed, over a regular n-gon."""
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    return sides + [tuple(range(n))[::-1], tuple(range(n, 2 * n))]


def make(polygons):
    """A layout whose charts are the polygons, two units a side and a vertex each unit, and its
    transitions, found by looking which unit sides have the same vertices."""
    number = {}
    vertex = lambda *key: number.setdefault(key, len(number))
    for f in polygons:
        for v in f:
            vertex("corner", v)
    middle = lambda a, b: vertex("middle", min(a, b), max(a, b))
    uv, faces, corners, part, parts, records = [], [], [], [], [], []

    def add_part(chart, corner, length, grid):
        """`grid`: vertex of each whole point (x, y)."""
        at = {}
        for (x, y), v in sorted(grid.items()):
            at[x, y] = len(uv)
            uv.append((float(x), float(y)))
        p = len(parts)
        for x in range(length):
            for y in range(length):
                square = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
                for a, b, c in ((0, 1, 2), (0, 2, 3)):
                    faces.append(tuple(grid[square[i]] for i in (a, b, c)))
                    corners.append(tuple(at[square[i]] for i in (a, b, c)))
                    part.append(p)
        parts.append((chart, corner))
        records.append({"part": p, "chart": chart, "corner": corner, "length": length,
                        "kind": "unfolded" if length == 2 else "split"})
        rim = ([(x, 0) for x in range(length)] + [(length, y) for y in range(length)]
               + [(length - x, length) for x in range(length)]
               + [(0, length - y) for y in range(length)])
        for i, a in enumerate(rim):
            b = rim[(i + 1) % len(rim)]
            sides.append((p, i // length, i % length, a, b, grid[a], grid[b]))

    sides = []
    for chart, f in enumerate(polygons):
        n = len(f)
        centre = vertex("centre", chart)
        c = [vertex("corner", v) for v in f]
        m = [middle(f[k], f[(k + 1) % n]) for k in range(n)]
        if n == 4:
            add_part(chart, 0, 2, {(0, 0): c[0], (1, 0): m[0], (2, 0): c[1], (2, 1): m[1],
                                   (2, 2): c[2], (1, 2): m[2], (0, 2): c[3], (0, 1): m[3],
                                   (1, 1): centre})
        else:
            for k in range(n):
                add_part(chart, k, 1, {(0, 0): c[k], (1, 0): m[k], (1, 1): centre,
                                       (0, 1): m[k - 1]})
    transitions, boundary, open_sides = [], [], {}
    for side in sides:
        p, k, u, a, b, v, w = side
        if (w, v) not in open_sides:
            open_sides[v, w] = side
            continue
        q, l, o, c, d, _, _ = open_sides.pop((w, v))
        for turn in range(4):
            moved = [layout_checks.turned(x, turn) for x in (c, d)]
            shift = (b[0] - moved[0][0], b[1] - moved[0][1])
            if (moved[1][0] + shift[0], moved[1][1] + shift[1]) == a:
                inner = parts[p][0] == parts[q][0]
                transitions.append({"part_a": q, "side_a": l, "unit_a": o, "part_b": p,
                                    "side_b": k, "unit_b": u, "turn": turn, "s": shift[0],
                                    "t": shift[1], "strand": None if inner else 0})
    for p, k, u, *_ in open_sides.values():
        boundary.append({"part": p, "side": k, "unit": u, "strand": 0})
    about = {"chart_side": 2, "charts": len(polygons), "parts": records,
             "transitions": transitions, "boundary": boundary}
    return Layout([(0, 0, 0)] * len(number), uv, faces, corners, part, parts), about


def all_problems(layout, about, surface):
    return (layout_checks.surface_problems(layout, *surface)
            + layout_checks.part_problems(layout)
            + layout_checks.transition_problems(about)
            + layout_checks.chart_problems(layout, about)
            + layout_checks.continuity_problems(layout, about)
            + layout_checks.continuity_problems(layout))


class LayoutChecks(unittest.TestCase):
    def test_what_is_right_passes(self):
        for polygons, surface in ((CUBE, (1, 0, 2)), (prism(5), (1, 0, 2)), (prism(3), (1, 0, 2)),
                                  (CUBE[1:], (1, 1, 1)), (prism(7)[:-1], (1, 1, 1)),
                                  (prism(5)[:-2], (1, 2, 0))):
            self.assertEqual(all_problems(*make(polygons), surface), [])

    def expect(self, found, *words):
        self.assertTrue(any(all(w in p for w in words) for p in found), (words, found))

    def test_broken_surfaces_are_found(self):
        layout, _ = make(prism(5))
        check = layout_checks.surface_problems
        self.expect(check(layout, 1, 0, 0), "another surface")
        self.expect(check(layout._replace(faces=layout.faces[1:]), 1, 0, 2), "another surface")
        torn = [tuple(len(layout.positions) if (i == 7 and k == 0) else v for k, v in enumerate(f))
                for i, f in enumerate(layout.faces)]
        self.expect(check(layout._replace(faces=torn, positions=layout.positions + [(0, 0, 0)]),
                          1, 0, 2), "another surface")
        twice = layout.faces + layout.faces[:1]
        self.expect(check(layout._replace(faces=twice), 1, 0, 2), "twice in one direction")
        self.expect(check(layout._replace(positions=layout.positions + [(0, 0, 0)]), 1, 0, 2),
                    "unused")

    def test_broken_parts_are_found(self):
        layout, _ = make(prism(5))
        check = layout_checks.part_problems
        flipped = [c[::-1] if i == 3 else c for i, c in enumerate(layout.corners)]
        faces = [f[::-1] if i == 3 else f for i, f in enumerate(layout.faces)]
        self.expect(check(layout._replace(corners=flipped, faces=faces)), "folded")
        flat = list(layout.uv)
        flat[layout.corners[3][0]] = flat[layout.corners[3][1]]
        self.expect(check(layout._replace(uv=flat)), "folded")
        thin = list(layout.uv)
        a, b, c = layout.corners[0]
        thin[a], thin[b], thin[c] = (0.1, 0.1), (0.3, 0.3), (0.2, 0.2)  # exactly: by rounding alone
        exact = layout_checks.signed_area(*(thin[t] for t in (a, b, c)))
        self.assertEqual(exact, 0)
        lost = [(c[0], c[1], len(layout.uv)) if i == 3 else c for i, c in enumerate(layout.corners)]
        self.expect(check(layout._replace(corners=lost)), "without coordinates")
        mixed = [layout.corners[-1] if i == 3 else c for i, c in enumerate(layout.corners)]
        self.expect(check(layout._replace(corners=mixed)), "two parts")
        holed = [i for i in range(len(layout.faces)) if i not in (1, 2, 5, 6)]
        self.expect(check(layout._replace(faces=[layout.faces[i] for i in holed],
                                          corners=[layout.corners[i] for i in holed],
                                          part=[layout.part[i] for i in holed])), "no disk")

    def test_breaks_between_parts_are_found(self):
        layout, about = make(prism(5))
        check = layout_checks.continuity_problems
        for t, p in enumerate(layout.uv):
            moved = list(layout.uv)
            # Along the rim, by little.
            if p[0] in (0.0, 2.0) and p[1] == 1.0:
                moved[t] = (p[0], 1.0 + 1e-7)
                self.expect(check(layout._replace(uv=moved), about), "do not continue")
                self.expect(check(layout._replace(uv=moved)), "do not continue")
                moved[t] = (p[0] + 1e-7, 1.0)
                self.expect(check(layout._replace(uv=moved), about), "side")
        for i, _ in enumerate(about["transitions"]):
            wrong = copy.deepcopy(about)
            wrong["transitions"][i]["s"] += 1
            self.expect(check(layout, wrong), "do not continue")
            self.expect(layout_checks.transition_problems(wrong), "side on side")
            wrong = copy.deepcopy(about)
            wrong["transitions"][i]["turn"] = (wrong["transitions"][i]["turn"] + 1) % 4
            self.expect(check(layout, wrong), "do not continue")
        wrong = copy.deepcopy(about)
        del wrong["transitions"][4]
        self.expect(check(layout, wrong), "without transition")
        self.expect(layout_checks.transition_problems(wrong), "missing")
        gone = [i for i, p in enumerate(layout.part) if p]  # all but part 0
        holed = layout._replace(faces=[layout.faces[i] for i in gone],
                                corners=[layout.corners[i] for i in gone],
                                part=[layout.part[i] for i in gone])
        self.expect(check(holed, about), "boundary")
        self.expect(check(holed, about), "do not make up")

    def test_transitions_that_do_not_close_up_are_found(self):
        _, about = make(CUBE)
        # Two sides of a cube whose transitions are sound one by one, but swapped.
        wrong = copy.deepcopy(about)
        a, b = wrong["transitions"][0], wrong["transitions"][5]
        a["part_b"], b["part_b"] = b["part_b"], a["part_b"]
        try:
            self.assertTrue(layout_checks.transition_problems(wrong))
        except AssertionError as error:
            self.assertIn("glued", str(error))

    def test_charts_that_are_no_disks_are_found(self):
        layout, about = make(prism(5))
        check = layout_checks.chart_problems
        wrong = copy.deepcopy(about)
        inner = [t for t in wrong["transitions"] if t["strand"] is None]
        inner[0]["strand"] = inner[1]["strand"] = 3
        self.expect(check(layout, wrong), "no disk")
        wrong = copy.deepcopy(about)
        wrong["parts"][0]["chart"] = 9
        self.expect(check(layout, wrong), "other parts")

    def test_base_complexes(self):
        check = layout_checks.base_complex_problems
        self.assertEqual(check(CUBE, 8, 1, 0, 2), [])
        self.expect(check(CUBE, 9, 1, 0, 2), "unused")
        self.expect(check(CUBE[1:], 8, 1, 0, 2), "another surface")
        self.expect(check(prism(3), 6, 1, 0, 2), "no quad")
        self.expect(check([(0, 1, 0, 2)], 3, 1, 0, 2), "repeats")
        self.expect(check([(0, 1, 2, 3), (0, 1, 4, 5)], 6, 1, 1, 1), "same vertices")


if __name__ == "__main__":
    unittest.main()
