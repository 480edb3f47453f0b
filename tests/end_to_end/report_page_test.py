# SPDX-License-Identifier: MIT
"""report.html in a browser: its numbers against report.json, sorting, filtering, the 3D view, and
five thousand scans. With RATTAN_SCREENSHOTS=DIR, pictures of it are left there."""

import json
import os
import re
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import urllib.parse
import zlib
from pathlib import Path

import browser
import fake_batch

RATTAN = os.environ["RATTAN"]
PICTURES = os.environ.get("RATTAN_SCREENSHOTS")
ODD_NAMES = [b'a"b\'<i>&amp;.ply', b"new\nline.ply", b"100% #1?.ply", "\u00fcb er.ply".encode(),
             b"caf\xe9.ply", b"--<!--.ply"]


def rattan(*words, allowed=(0,)):
    done = subprocess.run([RATTAN, *words], capture_output=True, timeout=600)
    assert done.returncode in allowed, (words, done.returncode, done.stderr)
    return done


def colours(path):
    """How many different pixels a PNG of 8 bits without interlacing has."""
    data = Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, *_ = struct.unpack(">IIBBBBB", body)
            assert depth == 8
            size = {2: 3, 6: 4}[colour]
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw = zlib.decompress(packed)
    stride, seen, before = size * width, set(), bytes(size * width)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        line = bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left = line[i - size] if i >= size else 0
            up, corner = before[i], before[i - size] if i >= size else 0
            p = left + up - corner
            near = [abs(p - left), abs(p - up), abs(p - corner)]
            add = [0, left, up, (left + up) // 2, (left, up, corner)[near.index(min(near))]][kind]
            line[i] = line[i] + add & 255
        seen.update(bytes(line[i : i + 3]) for i in range(0, stride, size))
        before = bytes(line)
    return len(seen)


def people(n):
    """The page's own rounding of a count, from its description."""
    if n < 10000:
        return f"{n:,}"
    for power, suffix in ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")):
        if n >= power * 0.9995:
            x = n / power
            digits = 0 if x >= 99.95 else 1 if x >= 9.995 else 2
            return f"{x:.{digits}f}\u00a0{suffix}"
    raise AssertionError(n)


def address(directory):
    return "file://" + urllib.parse.quote(os.fsencode(os.path.join(directory, "report.html")))


ROWS = """return [...document.querySelectorAll("#box tbody tr[data-place]")].map((row) => ({
  index: Number(row.getAttribute("aria-rowindex")), place: Number(row.dataset.place),
  name: row.querySelector(".name").title, status: row.querySelector(".status").textContent,
  text: row.textContent,
  cells: Object.fromEntries([...row.querySelectorAll("td[data-key]")]
    .map((cell) => [cell.dataset.key, [cell.textContent, cell.title]])) }));"""


@unittest.skipIf(browser.missing(), browser.missing())
class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        root = os.fsencode(cls.scratch.name)
        scans = os.path.join(root, b"scans")
        os.makedirs(os.path.join(scans, b"sub folder"))
        rattan("synth", "-o", os.path.join(scans, b"first.ply"), "--triangles", "12000")
        rattan("synth", "-o", os.path.join(scans, b"sub folder/second.ply"), "--triangles", "40000",
               "--seed", "3")
        for name in ODD_NAMES:
            shutil.copy(os.path.join(scans, b"first.ply"), os.path.join(scans, name))
        with open(os.path.join(scans, b"<b>broken<i>.ply"), "wb") as file:
            file.write(b"ply\nformat ascii 1.0\nelement vertex 12\n")
        cls.out = os.path.join(cls.scratch.name, "out & more #1")
        rattan("batch", scans, "-o", cls.out, "--quiet", allowed=(3,))
        cls.report = json.loads(Path(cls.out, "report.json").read_text(encoding="utf-8"))
        cls.browser = browser.Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()
        cls.scratch.cleanup()

    def tearDown(self):
        errors = [text for level, text in self.browser.console() if level != "DEBUG"]
        self.assertEqual(errors, [])
        for asked in self.browser.requests():
            self.assertRegex(asked, "^(file|data):")

    def open(self, directory=None):
        self.browser.open(address(directory or self.out))
        self.browser.wait_for("document.documentElement.dataset.ready")

    def shoot(self, name, b=None, whole=True):
        if PICTURES:
            (b or self.browser).picture(os.path.join(PICTURES, name + ".png"), whole)

    def test_numbers_are_those_of_the_json(self):
        self.open()
        totals, scans = self.report["totals"], self.report["scans"]
        self.assertEqual(totals["scans"], len(ODD_NAMES) + 3)
        self.assertEqual(totals["done"], len(ODD_NAMES) + 2)
        self.assertEqual(totals["unusable"], 1)
        self.assertEqual(totals["triangles"], sum(s["triangles"] or 0 for s in scans))
        self.assertEqual(totals["faces"], sum(s["faces"] or 0 for s in scans))
        tiles = self.browser.run("""return Object.fromEntries(
          [...document.querySelectorAll("#tiles > div")].map((tile) => [tile.dataset.key,
            [tile.querySelector("dd").firstChild.textContent, tile.querySelector("dd").title]]));""")
        for key in ("triangles", "faces"):
            self.assertEqual(tiles[key], [people(totals[key]), f"{totals[key]:,}"])
        exact = tiles["triangles_per_second"][1].split()[0].replace(",", "")
        self.assertEqual(float(exact), totals["triangles_per_second"])
        self.assertIn(f"{totals['done']} of {totals['scans']}",
                      self.browser.run("return document.getElementById('headline').textContent")
                      .replace("\u00a0", " "))
        rows = self.browser.run(ROWS)
        self.assertEqual(len(rows), len(scans))
        by_name = {scan["id"]: scan for scan in scans}
        for row in rows:
            scan = by_name[row["name"]]
            self.assertEqual(row["status"], scan["status"])
            if scan["status"] != "done":
                self.assertIn("The file ends", row["text"].replace("the file ends", "The file ends"))
                continue
            shown = lambda key: row["cells"][key]
            for key, figure in (("triangles", "triangles"), ("faces", "faces"),
                                ("irregular", "irregular_vertices"),
                                ("singularities", "singularities")):
                self.assertEqual(shown(key)[0], people(scan[figure]), key)
                self.assertEqual(shown(key)[1].split()[0], f"{scan[figure]:,}", key)
            self.assertEqual(shown("quads")[0], f"{100 * scan['quads'] / scan['faces']:.1f}")
            self.assertEqual(shown("stretch")[0], f"{scan['stretch']:.3f}")
            self.assertEqual(shown("shear")[0], f"{scan['shear']:.3f}")
            self.assertEqual(float(shown("shear")[1]), scan["shear"])
            distance = scan["distance"]
            most = max(distance["to_input_max"], distance["from_input_max"])
            self.assertAlmostEqual(float(shown("distance_max")[0]),
                                   100 * most / distance["diagonal"], delta=0.006)
            self.assertIn("MiB", shown("peak_rss")[0])
            self.assertEqual(int(shown("peak_rss")[1].split()[0].replace(",", "")),
                             scan["peak_rss_bytes"])
            self.assertEqual(float(shown("seconds")[1].split()[0]), scan["seconds"])
            self.assertEqual(int(shown("repairs")[0]), sum(scan["repairs"].values()))
            self.assertEqual(int(shown("warnings")[0]), len(scan["warnings"]))
        # The failure stands on top, with its sentence and its log.
        failures = self.browser.run("return document.getElementById('failures').textContent")
        self.assertIn("<b>broken<i>.drc", failures)
        self.assertRegex(failures, "(?i)the file ends")
        log = self.browser.run("return document.querySelector('#failures a').href")
        path = urllib.parse.unquote_to_bytes(urllib.parse.urlsplit(log).path)
        self.assertIn(b"the file ends", Path(os.fsdecode(path)).read_bytes())
        self.shoot("real")

    def test_every_link_and_picture_leads_to_its_file(self):
        self.open()
        self.browser.wait_for("[...document.querySelectorAll('#box img')].length > 7 && "
                              "[...document.querySelectorAll('#box img')].every((i) => "
                              "i.complete && i.naturalWidth === 320)")
        names = [row["name"] for row in self.browser.run(ROWS) if row["status"] == "done"]
        for name in names:
            self.browser.run("[...document.querySelectorAll('#box .name')]"
                             ".find((b) => b.title === arguments[0]).click()", name)
            self.browser.wait_for("Number(document.querySelector('canvas').dataset.drawn) > 0")
            for link in self.browser.run("return [...document.querySelectorAll('.files a')]"
                                         ".map((a) => a.href)"):
                path = urllib.parse.unquote_to_bytes(urllib.parse.urlsplit(link).path)
                self.assertTrue(os.path.isfile(path), path)
            self.assertEqual(
                self.browser.run("return document.getElementById('details-title').textContent"),
                name.split("/")[-1])
            self.browser.click("dialog .close")

    def test_sorts_by_mouse_and_keyboard(self):
        self.open()
        order = lambda: [row["name"] for row in self.browser.run(ROWS)]
        sort_of = lambda key: self.browser.run(
            "return document.querySelector(`th[data-key=${arguments[0]}]`)"
            ".getAttribute('aria-sort')", key)
        by_faces = sorted((s for s in self.report["scans"] if s["faces"] is not None),
                          key=lambda s: -s["faces"])
        self.browser.click("th[data-key=faces] button")
        self.assertEqual(sort_of("faces"), "descending")
        self.assertEqual(order()[0], by_faces[0]["id"])
        self.assertEqual(order()[-1], "<b>broken<i>.drc")  # what is unknown comes last
        self.browser.click("th[data-key=faces] button")
        self.assertEqual(sort_of("faces"), "ascending")
        self.assertEqual(order()[-2], by_faces[0]["id"])
        self.assertEqual(order()[-1], "<b>broken<i>.drc")
        self.browser.run("document.querySelector('th[data-key=status] button').focus()")
        self.browser.keys("\ue007")
        self.assertEqual(sort_of("status"), "ascending")
        self.assertIsNone(sort_of("faces"))
        self.assertEqual(order()[0], "<b>broken<i>.drc")
        self.browser.run("document.querySelector('#box .name').focus()")
        self.browser.keys("\ue015", "\ue015")  # down, down
        self.assertEqual(self.browser.run("return document.activeElement.title"), order()[2])
        self.browser.keys("\ue007")
        self.browser.wait_for("document.getElementById('details').open")
        self.browser.keys("\ue00c")
        self.browser.wait_for("!document.getElementById('details').open")

    def test_filters(self):
        self.open()
        names = lambda: {row["name"] for row in self.browser.run(ROWS)}
        everything = {scan["id"] for scan in self.report["scans"]}
        most = max(scan["faces"] or 0 for scan in self.report["scans"])
        for text, expected in (
                ("SECOND", {"sub folder/second.drc"}),
                ("-second", everything - {"sub folder/second.drc"}),
                (f"faces>={most}", {"sub folder/second.drc"}),
                ("triangles>20k triangles<1M", {"sub folder/second.drc"}),
                ('"sub folder"', {"sub folder/second.drc"}),
                ("<b>", {"<b>broken<i>.drc"}),
                ("no such scan", set()),
                ("", everything)):
            self.browser.type("#query", text or " ")
            end = time.monotonic() + 20
            while names() != expected and time.monotonic() < end:
                time.sleep(0.05)  # the page waits for a pause in typing
            self.assertEqual(names(), expected, text)
        self.browser.type("#query", "nonsense>5")
        self.browser.wait_for("document.getElementById('query-error').textContent !== ''")
        self.browser.type("#query", " ")
        self.browser.click("#chips button[data-status=unusable]")
        self.assertEqual(names(), {"<b>broken<i>.drc"})
        self.browser.click("#chips button[data-status=all]")
        self.assertEqual(names(), everything)

    def test_the_3d_view_shows_the_mesh_and_turns(self):
        self.open()
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "view.png")
            shoot = lambda: self.browser.picture(picture)
            self.browser.click("#box .picture:not(.empty)")
            self.browser.wait_for("Number(document.querySelector('canvas').dataset.drawn) > 0")
            self.browser.run("document.querySelector('.facts').hidden = true")
            shoot()
            before = Path(picture).read_bytes()
            self.assertGreater(colours(picture), 300)  # shades, not a blank stage
            self.shoot("3d", whole=False)
            covered = self.browser.run("""
              const canvas = document.querySelector("canvas");
              const copy = document.createElement("canvas");
              copy.width = canvas.width; copy.height = canvas.height;
              return new Promise((resolve) => requestAnimationFrame(() => {
                // In the frame in which it is drawn its pixels can be read.
                canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
                requestAnimationFrame(() => {
                  const context = copy.getContext("2d");
                  context.drawImage(canvas, 0, 0);
                  const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
                  let n = 0;
                  for (let i = 3; i < pixels.length; i += 4) n += pixels[i] > 200 ? 1 : 0;
                  resolve(n / (copy.width * copy.height));
                });
              }));""")
            self.assertGreater(covered, 0.1)
            self.assertLess(covered, 0.9)
            self.browser.drag("canvas", 120, 30)
            drawn = self.browser.run("return Number(document.querySelector('canvas').dataset.drawn)")
            self.assertGreater(drawn, 1)
            shoot()
            self.assertNotEqual(before, Path(picture).read_bytes())
            self.browser.click(".tools button:last-child")
            self.assertEqual(self.browser.run(
                "return document.querySelector('.tools button:last-child')"
                ".getAttribute('aria-pressed')"), "false")

    def test_failed_scans_tell_why(self):
        self.open()
        self.browser.click("#failures .name")
        self.browser.wait_for("document.getElementById('details').open")
        text = self.browser.run("return document.querySelector('.why').textContent")
        sentence = next(s["sentence"] for s in self.report["scans"] if s["status"] == "unusable")
        self.assertEqual(text, sentence)
        self.assertTrue(self.browser.run("return document.querySelector('.stage').hidden"))

    def test_fits_phones_and_dark_rooms(self):
        for name, width, height, dark in (("phone", 390, 844, False), ("dark", 1440, 900, True)):
            with browser.Browser(width, height, dark) as b:
                b.open(address(self.out))
                b.wait_for("document.documentElement.dataset.ready")
                self.assertLessEqual(b.run("return document.documentElement.scrollWidth"), width)
                ground = b.run("return getComputedStyle(document.body).backgroundColor")
                self.assertEqual(sum(map(int, re.findall(r"\d+", ground)[:3])) < 150, dark)
                self.shoot(name, b)
                b.click("#box .picture:not(.empty)")
                b.wait_for("Number(document.querySelector('canvas').dataset.drawn) > 0")
                self.shoot(name + "-3d", b, whole=False)

    def test_five_thousand_scans_stay_usable(self):
        some = Path(self.out, "report", "first.drc")
        many = os.path.join(self.scratch.name, "many")
        fake_batch.make(many, 5000, some / "thumbnail.png", some / "view.js")
        rattan("batch", "--report", many)
        report = json.loads(Path(many, "report.json").read_text(encoding="utf-8"))
        # The best of some: other work on the machine is not the page's.
        seconds = []
        for _ in range(3):
            self.browser.open("about:blank")
            seconds.append(self.browser.open(address(many)))
            self.browser.wait_for("document.documentElement.dataset.ready")
        self.assertLess(min(seconds), 2.0)
        milliseconds = lambda: float(self.browser.run(
            "return document.getElementById('box').dataset.milliseconds"))
        for key in ("faces", "quads", "seconds", "name"):
            taken = []
            for _ in range(3):
                self.browser.click(f"th[data-key={key}] button")
                taken.append(milliseconds())
            self.assertLess(min(taken), 100.0, key)
        taken = []
        for _ in range(3):
            self.browser.type("#query", "coins quads<95")
            taken.append(milliseconds())
        self.assertLess(min(taken), 100.0)
        expected = sum(1 for s in report["scans"] if "coins" in s["id"] and s["faces"] and
                       100 * s["quads"] / s["faces"] < 95)
        self.browser.wait_for(f"document.getElementById('shown').textContent.startsWith("
                              f"'{expected:,} of')")
        self.browser.type("#query", " ")
        self.browser.click("#chips button[data-status=all]")
        self.assertLess(self.browser.run("return document.querySelectorAll('*').length"), 6000)
        # Down to the last row.
        self.browser.run("const box = document.getElementById('box');"
                         "box.scrollTop = box.scrollHeight")
        self.browser.wait_for("[...document.querySelectorAll('#box tr[data-place]')].some("
                              "(row) => row.getAttribute('aria-rowindex') === '5001')")
        self.browser.run("document.getElementById('box').scrollTop = 0; scrollTo(0, 0)")
        self.shoot("many")


if __name__ == "__main__":
    unittest.main()
