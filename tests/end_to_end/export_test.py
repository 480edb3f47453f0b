# SPDX-License-Identifier: MIT
"""rattan export from outside: what VTK's own reader finds in the file, judged by the formulas that
the fields come from; errors; the same bytes."""

import array
import collections
import json
import math
import os
import pickle
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import scan_samples

RATTAN = os.environ["RATTAN"]
DUMP = Path(__file__).with_name("vtk_dump.py")


def rattan(*words, **more):
    return subprocess.run([RATTAN, *map(str, words)], capture_output=True, text=True, timeout=300,
                          **more)


def python_with_vtk():
    for python in (sys.executable, "/usr/bin/python3"):
        if subprocess.run([python, DUMP], capture_output=True).returncode == 0:
            return python
    return None


PYTHON = python_with_vtk()


class Array:
    """Rows of numbers."""

    def __init__(self, value):
        self.width, self.format, data = value
        self.numbers = array.array(self.format, data)

    def __len__(self):
        return len(self.numbers) // self.width

    def __getitem__(self, row):
        if self.width == 1:
            return self.numbers[row]
        return self.numbers[self.width * row : self.width * (row + 1)]

    def __iter__(self):
        return (self[i] for i in range(len(self)))


class Grid:
    """A file as VTK's reader sees it."""

    def __init__(self, path):
        out = str(path) + ".pickle"
        subprocess.run([PYTHON, DUMP, path, out], check=True, capture_output=True, timeout=300)
        with open(out, "rb") as file:
            raw = pickle.load(file)
        self.kind, self.said = raw["class"], raw["said"]
        self.points, ids = Array(raw["points"]), Array(raw["connectivity"])
        self.offsets, self.types = list(Array(raw["offsets"])), set(Array(raw["types"]))
        self.cells = [tuple(ids.numbers[k : k + 3]) for k in range(0, len(ids), 3)]
        self.point = {n: Array(v) for n, v in raw["point_data"].items()}
        self.cell = {n: Array(v) for n, v in raw["cell_data"].items()}
        self.field = {n: v if isinstance(v, list) else Array(v)
                      for n, v in raw["field_data"].items()}


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def turned(r, pair):
    """The pair carried by r quarter turns."""
    a, b = pair
    return ((a, b), (b, -a), (-a, -b), (-b, a))[r]


def off_period(x):
    """How far from a whole number of periods."""
    return abs(x - 2 * math.pi * round(x / (2 * math.pi)))


def ply_points(path):
    head, _, body = path.read_bytes().partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    return list(struct.iter_unpack("<3f", body[: 12 * count]))


def euler_and_loops(cells):
    """Of a mesh that must be manifold and consistently oriented."""
    sides = collections.Counter()
    for a, b, c in cells:
        sides.update(((a, b), (b, c), (c, a)))
    assert max(sides.values()) == 1, "each side has one triangle to its left"
    edges = {tuple(sorted(s)) for s in sides}
    onward = {b: a for a, b in sides if (b, a) not in sides}
    assert len(onward) == sum((b, a) not in sides for a, b in sides), "one loop a boundary vertex"
    loops, seen = 0, set()
    for start in onward:
        if start not in seen:
            loops += 1
            at = start
            while at not in seen:
                seen.add(at)
                at = onward[at]
    return len({v for c in cells for v in c}) - len(edges) + len(cells), loops, set(onward)


class Base(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)

    @classmethod
    def make_work(cls, scan, name, *words):
        """The work directory and the report of a run."""
        out, report = cls.folder / f"{name}-out.obj", cls.folder / f"{name}.json"
        done = rattan("remesh", scan, "-o", out, "--quiet", "--keep-work", "--report", report,
                      *words)
        assert done.returncode == 0, done.stderr
        return Path(f"{out}.work"), json.loads(report.read_text())

    @classmethod
    def export(cls, work, name, *words):
        path = cls.folder / name
        done = rattan("export", work, "-o", path, *words)
        assert done.returncode == 0, done.stderr
        assert done.stderr == "" or "export" in done.stderr
        return path


@unittest.skipUnless(PYTHON, "no Python here has VTK: apt-get install python3-vtk9")
class AsVtkReadsIt(Base):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scan = cls.folder / "scan.ply"
        rattan("synth", "-o", cls.scan, "--triangles", 24000, "--genus", 1, "--holes", 2, "--quiet")
        cls.work, cls.report = cls.make_work(cls.scan, "scan", "--ratio", 0.08)
        cls.path = cls.export(cls.work, "scan.vtkhdf")
        cls.grid = Grid(cls.path)

    def test_points_and_cells_are_the_scan(self):
        g = self.grid
        self.assertEqual((g.kind, g.said), ("vtkUnstructuredGrid", ""))
        self.assertEqual(len(g.points), self.report["input"]["vertices"])
        self.assertEqual(len(g.cells), self.report["input"]["triangles"])
        self.assertEqual(g.points.format, "d")
        self.assertEqual(g.types, {5})
        self.assertEqual(g.offsets, list(range(0, 3 * len(g.cells) + 1, 3)))
        self.assertEqual(sorted(map(tuple, g.points)), sorted(ply_points(self.scan)))
        self.assertEqual(min(min(c) for c in g.cells), 0)
        self.assertEqual(max(max(c) for c in g.cells), len(g.points) - 1)
        euler, loops, boundary = euler_and_loops(g.cells)
        self.assertEqual(euler, self.report["input"]["euler"])
        self.assertEqual(loops, self.report["input"]["boundary_loops"])
        self.assertEqual({v for v, flag in enumerate(g.point["boundary"]) if flag}, boundary)

    def test_every_array_is_whole_and_finite(self):
        g = self.grid
        self.assertEqual(set(g.point), {
            "boundary", "feature", "low_passed_position", "normal", "curvature_tensor",
            "curvature_1", "curvature_2", "curvature_direction_1", "curvature_fidelity", "K",
            "K_perp", "curl_scale", "pins", "theta", "phi", "norms", "pin_energy",
            "singular_vertex", "singular_edges"})
        self.assertEqual(set(g.cell), {"tile", "energy", "singularity", "corner_theta",
                                       "corner_phi"})
        for data, rows in ((g.point, len(g.points)), (g.cell, len(g.cells))):
            for name, values in data.items():
                self.assertEqual(len(values), rows, name)
                self.assertTrue(all(map(math.isfinite, values.numbers)), name)
        self.assertEqual(sorted(set(g.cell["tile"])), list(range(max(g.cell["tile"]) + 1)))
        self.assertGreater(max(g.cell["tile"]), 0)
        for name in "pins", "feature", "norms", "curl_scale", "curvature_1":
            self.assertGreater(len(set(g.point[name].numbers)), 1, name)

    def test_fields_are_what_they_say(self):
        p = self.grid.point
        for v in range(len(self.grid.points)):
            n, k, perp = p["normal"][v], p["K"][v], p["K_perp"][v]
            self.assertAlmostEqual(dot(n, n), 1.0, 5)
            self.assertAlmostEqual(dot(k, k), 1.0, 5)
            self.assertAlmostEqual(dot(n, k), 0.0, 5)
            self.assertLess(max(map(abs, minus(perp, cross(n, k)))), 1e-6)
            self.assertGreater(p["curl_scale"][v], 0.0)
            self.assertTrue(all(0.0 < norm < 2.0 for norm in p["norms"][v]))
            self.check_curvature(p, v)

    def check_curvature(self, p, v):
        """The tensor, taken into the tangent plane, has the principal curvatures for eigenvalues,
        and the direction across the first is the eigenvector of the first."""
        n, d = p["normal"][v], p["curvature_direction_1"][v]
        k1, k2 = p["curvature_1"][v], p["curvature_2"][v]
        self.assertGreaterEqual(abs(k1) + 1e-6, abs(k2))
        f = p["curvature_fidelity"][v]
        self.assertTrue(0.0 <= f <= 1.0)
        if f < 1e-3:
            return
        self.assertAlmostEqual(dot(d, d), 1.0, 5)
        self.assertAlmostEqual(dot(d, n), 0.0, 5)
        xx, yy, zz, xy, yz, xz = p["curvature_tensor"][v]
        across = cross(n, d)

        def form(a, b):
            return dot(a, (xx * b[0] + xy * b[1] + xz * b[2], xy * b[0] + yy * b[1] + yz * b[2],
                           xz * b[0] + yz * b[1] + zz * b[2]))
        slack = 1e-4 * (abs(k1) + abs(k2))
        self.assertLess(abs(form(across, across) - k1), slack)
        self.assertLess(abs(form(d, d) - k2), slack)
        self.assertLess(abs(form(d, across)), slack)

    def test_phases_follow_the_field(self):
        """Corner values are the phases of the vertices up to quarter turns and periods; between
        corners they differ by what the field asks for, to within half a period."""
        g, p = self.grid, self.grid.point
        omega, kinds = g.field["omega"][0], g.cell["singularity"]
        asked, off = 0, 0.0
        for t, cell in enumerate(g.cells):
            corners = list(zip(g.cell["corner_theta"][t], g.cell["corner_phi"][t]))
            if kinds[t] in (1, 2):
                self.assertEqual(corners, [(0.0, 0.0)] * 3)
                continue
            k0, perp0 = p["K"][cell[0]], p["K_perp"][cell[0]]
            frames = []
            for v, corner in zip(cell, corners):
                phases, frame = (p["theta"][v], p["phi"][v]), (p["K"][v], p["K_perp"][v])
                fits = [r for r in range(4)
                        if max(off_period(a - b) for a, b in zip(turned(r, phases), corner)) < 1e-5]
                self.assertTrue(fits, (t, v))

                def aligned(r):
                    k = frame[r % 2] if r < 2 else [-x for x in frame[r % 2]]
                    perp = [(1, 1), (-1, 1), (-1, -1), (1, -1)][r][0]
                    other = frame[1 - r % 2]
                    return k, [perp * x for x in other]
                # K turned by r: K, K_perp, -K, -K_perp; with it K_perp, -K, -K_perp, K.
                r = max(fits, key=lambda r: dot(aligned(r)[0], k0) + dot(aligned(r)[1], perp0))
                frames.append([[p["curl_scale"][v] * x for x in d] for d in aligned(r)])
            if any(p["pins"][v] for v in cell):
                continue
            for i, j in ((0, 1), (1, 2), (2, 0)):
                e = minus(p["low_passed_position"][cell[j]], p["low_passed_position"][cell[i]])
                for c in range(2):
                    wanted = math.pi / omega * dot([a + b for a, b in zip(frames[i][c],
                                                                          frames[j][c])], e)
                    miss = abs(corners[j][c] - corners[i][c] - wanted)
                    self.assertLess(miss, math.pi + 1e-4, (t, i, j))
                    asked, off = asked + 1, off + miss
        self.assertGreater(asked, 3 * len(g.cells))
        self.assertLess(off / asked, 0.5)

    def test_singularities_are_those_of_the_report(self):
        g, told = self.grid, self.report["singularities"]
        kinds = collections.Counter(g.cell["singularity"])
        self.assertEqual(sum(kinds[k] for k in (1, 2, 3)), told["triangles"])
        self.assertLessEqual(set(kinds), {0, 1, 2, 3})
        self.assertEqual(list(g.field["singular_triangles"]), [kinds[k] for k in (1, 2, 3)])
        self.assertEqual(sum(g.point["singular_vertex"]), told["vertices"])
        self.assertEqual(sum(g.point["singular_edges"]), 2 * told["edges"])
        self.assertEqual(g.field["singular_vertices"][0], told["vertices"])
        self.assertEqual(g.field["singular_edges"][0], told["edges"])
        folded = [t for t, kind in enumerate(g.cell["singularity"]) if kind in (0, 3)]
        for t in folded:
            (a, b, c), (d, e, f) = g.cell["corner_theta"][t], g.cell["corner_phi"][t]
            area = (b - a) * (f - d) - (c - a) * (e - d)
            if abs(area) > 1e-5:
                self.assertEqual(area < 0, g.cell["singularity"][t] == 3)

    def test_energies_sum_to_the_report(self):
        g = self.grid
        solver = {s["system"]: s for s in self.report["solver"]}
        energy = solver["parameterization"]["energy_unit"]
        edges, pins = sum(g.cell["energy"]), sum(g.point["pin_energy"])
        self.assertLess(abs(edges + pins - energy), 1e-5 * energy)
        self.assertGreaterEqual(min(g.cell["energy"]), 0.0)
        self.assertGreater(pins, 0.0)
        for told, summed in zip(g.field["energy_of_edges_and_pins"], (edges, pins)):
            self.assertAlmostEqual(told, summed, 6)
        for system, e, unit in zip(g.field["solver_system"], g.field["solver_energy"],
                                   g.field["solver_energy_unit"]):
            self.assertEqual((e, unit), (solver[system]["energy"], solver[system]["energy_unit"]))

    def test_energies_of_triangles_are_their_sides(self):
        """PGP Eq. 15 from positions, fields and phases, for triangles whose sides are regular."""
        g, p = self.grid, self.grid.point
        apexes = collections.defaultdict(list)
        for a, b, c in g.cells:
            for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
                apexes[min(i, j), max(i, j)].append(k)
        position = [tuple(x) for x in p["low_passed_position"]]

        def half_cotangent(a, i, j):
            u, v = minus(position[i], position[a]), minus(position[j], position[a])
            return 0.5 * dot(u, v) / math.sqrt(dot(cross(u, v), cross(u, v)))
        omega, checked = g.field["omega"][0], 0
        for t in range(0, len(g.cells), 7):
            if any(p["pins"][v] for v in g.cells[t]):
                continue
            energy = 0.0
            for i, j in zip(g.cells[t], g.cells[t][1:] + g.cells[t][:1]):
                i, j = min(i, j), max(i, j)
                weight = min(50.0, max(0.02, sum(half_cotangent(a, i, j) for a in apexes[i, j])))
                share = 0.5 if len(apexes[i, j]) == 2 else 1.0
                frames = [(p["K"][v], p["K_perp"][v]) for v in (i, j)]
                scales = [p["curl_scale"][v] for v in (i, j)]
                straight = dot(frames[0][0], frames[1][0]) + dot(frames[0][1], frames[1][1])
                aside = dot(frames[0][0], frames[1][1]) - dot(frames[0][1], frames[1][0])
                if abs(straight) >= abs(aside):
                    r = 0 if straight >= 0 else 2
                else:
                    r = 1 if aside >= 0 else 3
                e = minus(position[j], position[i])
                near = [scales[0] * dot(d, e) for d in frames[0]]
                far = turned(r, [scales[1] * dot(d, e) for d in frames[1]])
                phases = turned(r, (p["theta"][j], p["phi"][j]))
                for c, start in enumerate((p["theta"][i], p["phi"][i])):
                    miss = phases[c] - start - math.pi / omega * (near[c] + far[c])
                    energy += share * weight * (2.0 - 2.0 * math.cos(miss))
            self.assertLess(abs(energy - g.cell["energy"][t]), 1e-4 * (1.0 + energy), t)
            checked += 1
        self.assertGreater(checked, 1000)

    def test_charts_of_a_layout(self):
        out, told = self.folder / "charts.obj", self.folder / "charts.json"
        done = rattan("layout", self.scan, "-o", out, "--quiet", "--keep-work", "--report", told)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(told.read_text())
        g = Grid(self.export(Path(f"{out}.work"), "charts.vtkhdf"))
        charts, energy = g.cell["chart"], report["solver"][-1]["energy_unit"]
        self.assertEqual(sum(k != 0 for k in g.cell["singularity"]),
                         report["singularities"]["triangles"])
        self.assertLess(abs(sum(g.cell["energy"]) + sum(g.point["pin_energy"]) - energy),
                        1e-5 * energy)
        sizes = collections.Counter(charts)
        count = report["charts"]["count"]
        self.assertTrue(0 <= min(sizes) and max(sizes) < count)
        self.assertGreater(len(sizes), 0.9 * count)
        # They are patches: about a perimeter's share of the sides lies between two of them.
        left = {side: t for t, (a, b, c) in enumerate(g.cells)
                for side in ((a, b), (b, c), (c, a))}
        between = [charts[t] != charts[left[b, a]] for (a, b), t in left.items() if (b, a) in left]
        self.assertLess(sum(between) / len(between), 0.3)

    def test_what_goes_with_the_fields(self):
        field = self.grid.field
        self.assertEqual(list(field["density"]), [self.report["options"]["density"]])
        self.assertEqual(tuple(field["origin"][0]), tuple(self.report["output"]["origin"]))
        self.assertIn("ratio=0.08", field["options"][0])
        self.assertIn(self.report["rattan"]["version"], field["rattan"][0])
        self.assertIn("radians", field["units"][0])
        self.assertEqual(field["unit"][0], 1.0)
        self.assertGreater(field["omega"][0], field["mean_edge_length"][0])

    def test_coordinates_far_from_zero(self):
        mesh = scan_samples.moved(scan_samples.torus(48, 24), by=(4.5e5, 5.1e6, 120.0))
        scan = self.folder / "far.obj"
        scan.write_bytes(scan_samples.obj(mesh))
        work, _ = self.make_work(scan, "far", "--faces", 300)
        g = Grid(self.export(work, "far.hdf"))
        self.assertGreater(abs(g.field["origin"][0][1]), 5e6)
        for a, b in zip(sorted(map(tuple, g.points)), sorted(mesh[0])):
            self.assertLess(max(map(abs, minus(a, b))), 1e-6)
        for a, b in zip(g.points, g.point["low_passed_position"]):
            self.assertLess(max(map(abs, minus(a, b))), 0.2)

    def test_tiny_coordinates(self):
        """The scan's unit isn't the file's: lengths, curvatures and phases are in the file's."""
        size = 1e-22
        scan = self.folder / "tiny.obj"
        scan.write_bytes(scan_samples.obj(scan_samples.moved(scan_samples.torus(48, 24, 2.0, 0.7),
                                                             scale=(size,) * 3)))
        work, _ = self.make_work(scan, "tiny", "--faces", 300)
        g = Grid(self.export(work, "tiny.vtkhdf"))
        self.assertNotEqual(g.field["unit"][0], 1.0)
        self.assertLess(max(abs(c) for p in g.points for c in p), 2.71 * size)
        inner = sum(abs(k) for k in g.point["curvature_1"]) / len(g.points) * size
        self.assertTrue(0.8 < inner * 0.7 < 1.2, inner)
        self.assertTrue(2 * size / 50 < g.field["omega"][0] < 2 * size)

    def test_directions_and_colours_of_the_scan(self):
        vertices, faces = scan_samples.torus(48, 24)
        scan, wish = self.folder / "led.obj", self.folder / "led.txt"
        lines = ["v {} {} {} {} 0.5 1".format(*p, i % 2) for i, p in enumerate(vertices)]
        scan.write_text("\n".join(lines + ["f {} {} {}".format(*(i + 1 for i in f))
                                           for f in faces]) + "\n")
        wish.write_text("".join(f"{-p[1]} {p[0]} 0 0.5\n" for p in vertices))
        work, _ = self.make_work(scan, "led", "--faces", 300, "--field", wish)
        g = Grid(self.export(work, "led.vtkhdf"))
        self.assertEqual(set(g.point["wanted_fidelity"]), {0.5})
        for p, d in zip(g.points, g.point["wanted_direction"]):
            around = math.hypot(p[0], p[1])
            self.assertLess(max(map(abs, minus(d, (-p[1] / around, p[0] / around, 0.0)))), 1e-5)
        self.assertEqual({c[0] for c in g.point["colour"]}, {0, 255})

    def test_as_far_as_the_work_came(self):
        seen = set()
        for made, least in (("mesh.*.h5", None), ("hierarchy.*.h5", "curvature_1"),
                            ("param.*.h5", "K"), ("remesh.*.h5", "theta")):
            out = self.folder / f"killed-{made[:5]}.obj"
            process = subprocess.Popen(
                [RATTAN, "remesh", self.scan, "-o", out, "--quiet"],
                env=dict(os.environ, RATTAN_CHECKPOINT_SECONDS="0"))
            work = Path(f"{out}.work")
            while process.poll() is None and not ((work / "checkpoint").exists()
                                                  and list(work.glob(made))):
                time.sleep(0.001)
            process.kill()
            process.wait()
            if not (work / "checkpoint").exists():
                continue  # it was faster
            path = self.folder / "part.vtkhdf"
            done = rattan("export", work, "-o", path)
            if least is None and done.returncode == 3:
                self.assertIn("nothing to export yet", done.stderr)
                continue
            self.assertEqual(done.returncode, 0, done.stderr)
            g = Grid(path)
            self.assertEqual((len(g.points), len(g.cells)),
                             (len(self.grid.points), len(self.grid.cells)))
            self.assertIn(least or "boundary", g.point)
            self.assertEqual("theta" not in g.point, "phases" in done.stdout)
            for name in set(g.point) - {"norms"}:
                self.assertEqual(len(g.point[name]), len(g.points))
            # What is final by then is as in the end; norms are kept on request only.
            self.assertNotIn("norms", g.point)
            if "curvature_1" in g.point:
                self.assertEqual(g.point["curvature_1"].numbers,
                                 self.other("curvature_1", work).numbers)
            seen.add(frozenset(g.point))
            shutil.rmtree(work)
        self.assertGreaterEqual(len(seen), 1)

    def other(self, name, work):
        """The array of a whole run with the same options as those that were killed."""
        if not hasattr(type(self), "plain"):
            whole, _ = self.make_work(self.scan, "plain")
            type(self).plain = Grid(self.export(whole, "plain.vtkhdf"))
        return self.plain.point[name]


class Command(Base):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scan = cls.folder / "scan.ply"
        rattan("synth", "-o", cls.scan, "--triangles", 60000, "--holes", 1, "--quiet")
        cls.work, _ = cls.make_work(cls.scan, "scan")

    def test_the_same_bytes_and_nothing_touched(self):
        before = {p.name: p.read_bytes() for p in self.work.iterdir()}
        first = self.export(self.work, "one.vtkhdf").read_bytes()
        for words in (("--threads", 1), ("--threads", 4), ("--memory", "64MiB"),
                      ("--memory", "1GiB", "--threads", 2, "--quiet")):
            again = self.export(self.work, "two.hdf", *words)
            self.assertEqual(again.read_bytes(), first, words)
        self.assertEqual({p.name: p.read_bytes() for p in self.work.iterdir()}, before)
        # An interrupted run that was taken up leaves the same fields.
        again = self.folder / "again.obj"
        words = ["remesh", self.scan, "-o", again, "--quiet", "--keep-work"]
        process = subprocess.Popen([RATTAN, *words],
                                   env=dict(os.environ, RATTAN_CHECKPOINT_SECONDS="0"))
        work = Path(f"{again}.work")
        while process.poll() is None and not list(work.glob("smoothing.*.h5")):
            time.sleep(0.001)
        process.kill()
        process.wait()
        done = rattan(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(again.read_bytes(), (self.folder / "scan-out.obj").read_bytes())
        self.assertEqual(self.export(work, "three.vtkhdf").read_bytes(), first)

    def test_the_budget_holds(self):
        scan = self.folder / "large.ply"
        rattan("synth", "-o", scan, "--triangles", 300000, "--quiet")
        work, _ = self.make_work(scan, "large", "--faces", 2000)
        first = None
        for budget in 64, 100, 400:
            path = self.folder / "large.vtkhdf"
            script = ("import resource, subprocess, sys\n"
                      "code = subprocess.run(sys.argv[1:]).returncode\n"
                      "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\n"
                      "sys.exit(code)\n")
            done = subprocess.run([sys.executable, "-c", script, RATTAN, "export", work, "-o", path,
                                   "--quiet", "--memory", f"{budget}MiB"],
                                  capture_output=True, text=True, timeout=300)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertLessEqual(int(done.stdout.split()[-1]), budget << 10)
            first = first or path.read_bytes()
            self.assertEqual(path.read_bytes(), first)

    def test_keeping_work_changes_no_output(self):
        out = self.folder / "plain.obj"
        done = rattan("remesh", self.scan, "-o", out, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(out.read_bytes(), (self.folder / "scan-out.obj").read_bytes())

    def test_errors_are_sentences(self):
        out = self.folder / "error.vtkhdf"
        empty = self.folder / "empty"
        empty.mkdir()
        for words, code, told in (
            ([], 2, "work is required"),
            ([self.work], 2, "output"),
            ([self.work, "-o", self.folder / "error.vtk"], 2, ".vtkhdf"),
            ([self.work, "-o", self.folder / "no" / "error.vtkhdf"], 2, "folder"),
            ([self.work, "-o", out, "--memory", "10MiB"], 4, "--memory"),
            ([self.folder / "none", "-o", out], 3, "no such directory"),
            ([self.scan, "-o", out], 3, "no such directory"),
            ([empty, "-o", out], 3, "--keep-work"),
            ([self.folder, "-o", out], 3, "--keep-work"),
        ):
            with self.subTest(words=words):
                done = rattan("export", *words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn("rattan: ", done.stderr)
                self.assertIn(told, done.stderr)
                self.assertFalse(out.exists())
        self.assertEqual(list(empty.iterdir()), [])

    def test_a_directory_at_work_is_refused(self):
        scan = self.folder / "long.ply"
        rattan("synth", "-o", scan, "--triangles", 400000, "--quiet")
        process = subprocess.Popen([RATTAN, "remesh", scan, "-o", self.folder / "long.drc",
                                    "--quiet"])
        work = self.folder / "long.drc.work"
        while process.poll() is None and not list(work.glob("lock.*")):
            time.sleep(0.001)
        time.sleep(0.1)
        done = rattan("export", work, "-o", self.folder / "long.vtkhdf")
        self.assertIsNone(process.poll(), "the run was to take longer")
        process.kill()
        process.wait()
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn(f"process {process.pid} on", done.stderr)

    def test_damaged_files_are_named(self):
        out = self.folder / "damaged.vtkhdf"
        for name in sorted(p.name for p in self.work.glob("*.h5")):
            work = self.folder / "damaged.work"
            shutil.copytree(self.work, work)
            file = work / name
            data = bytearray(file.read_bytes())
            for at in range(2048, len(data), 251):
                data[at] ^= 0xFF
            file.write_bytes(data)
            done = rattan("export", work, "-o", out)
            # Files that nothing is read of may be as they are.
            if done.returncode == 0:
                self.assertRegex(name, "^(hierarchy|solve|remesh)")
                out.unlink()
            else:
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertIn(name, done.stderr)
                self.assertFalse(out.exists())
            self.assertFalse(list(self.folder.glob(".damaged*")))
            shutil.rmtree(work)

    def test_a_full_disk(self):
        done = rattan("export", self.work, "-o", self.folder / "full.vtkhdf",
                      preexec_fn=lambda: __import__("resource").setrlimit(
                          __import__("resource").RLIMIT_FSIZE, (1 << 20, 1 << 20)))
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("MiB", done.stderr)
        self.assertEqual(list(self.folder.glob("*full*")), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
