# SPDX-License-Identifier: MIT
"""What cpack makes: the Debian package unpacks and runs; the bundle runs from wherever it was moved,
with nothing of the system but glibc."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
BUILD = Path(os.environ["RATTAN_BUILD"])
GLIBC = re.compile(r"/(libc|libm|libdl|libpthread|librt|ld-linux-x86-64)\.so\.\d$")


def run(*words, **kwargs):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=300,
                          **kwargs)


def need(*words, **kwargs):
    done = run(*words, **kwargs)
    if done.returncode != 0:
        raise AssertionError(f"{words}\n{done.stdout}\n{done.stderr}")
    return done.stdout


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="rattan-test."))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.debian = all(shutil.which(tool) for tool in ("dpkg-deb", "dpkg-shlibdeps"))
        need("cpack", "-G", "DEB;TGZ" if cls.debian else "TGZ", "-B", cls.folder,
             "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip", cwd=BUILD)  # faster than xz
        if not cls.debian:
            print("skipped: dpkg-deb or dpkg-shlibdeps is missing, no Debian package was made")
        cls.scan = cls.folder / "scan.ply"
        need(RATTAN, "synth", "-o", cls.scan, "--triangles", 20000, "--quiet")
        cls.expected = cls.folder / "expected.drc"
        need(RATTAN, "remesh", cls.scan, "-o", cls.expected, "--quiet")
        archive, = cls.folder.glob("rattan-*.tar.gz")
        need("tar", "xf", archive, "-C", cls.folder)
        unpacked, = cls.folder.glob("rattan-*-linux-*/")
        cls.bundle = unpacked.rename(cls.folder / "moved here")

    def check_remesh(self, rattan, **kwargs):
        out = self.folder / "out.drc"
        need(rattan, "remesh", self.scan, "-o", out, "--quiet", "--preview",
             self.folder / "out.png", **kwargs)
        self.assertEqual(out.read_bytes(), self.expected.read_bytes())

    def package(self, name):
        if not self.debian:
            self.skipTest("dpkg-deb or dpkg-shlibdeps is missing")
        file, = self.folder.glob(f"{name}_*.deb")
        return file

    def unpack(self, name):
        file = self.package(name)
        target = self.folder / name
        if not target.exists():
            need("dpkg-deb", "-x", file, target)
        return target

    def test_debian_package(self):
        file, root = self.package("rattan"), self.unpack("rattan")
        self.check_remesh(root / "usr/bin/rattan")
        depends = need("dpkg-deb", "-f", file, "Depends")
        for name in ("libc6", "libtbb12", "libembree3-3", "libdraco7", "libjemalloc2"):
            self.assertRegex(depends, rf"\b{name}\b")
        self.assertNotIn("curl", depends)
        for program in ("rattan", "rattan-bench"):
            self.assertNotRegex(need("readelf", "-d", root / "usr/bin" / program), "RPATH|RUNPATH")
        self.assertTrue((root / "usr/share/doc/rattan/copyright").exists())

    def test_debian_development_package(self):
        root = self.unpack("librattan-dev")
        for path in ("usr/lib/librattan.a", "usr/include/rattan/remesh.h",
                     "usr/lib/cmake/rattan/rattan-config.cmake"):
            self.assertTrue((root / path).exists(), path)

    def test_lintian(self):
        if not shutil.which("lintian"):
            self.skipTest("lintian is missing")
        done = run("lintian", "--fail-on", "error,warning", self.package("rattan"),
                   self.package("librattan-dev"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_bundle_loads_nothing_but_glibc_from_outside(self):
        log = self.folder / "loaded"
        environment = {"LD_DEBUG": "libs", "LD_DEBUG_OUTPUT": str(log), "LD_LIBRARY_PATH": "",
                       "PATH": "/nowhere"}
        self.check_remesh(self.bundle / "bin/rattan", env=environment, cwd="/")
        text = "".join(p.read_text(errors="replace") for p in self.folder.glob("loaded.*"))
        loaded = {Path(p) for p in re.findall(r"calling init: (/.*)", text)}
        inside = {p.name for p in loaded if self.bundle / "lib" in p.parents
                  or (self.bundle / "lib").samefile(p.parent)}
        outside = [str(p) for p in loaded if p.name not in inside]
        for path in outside:
            self.assertRegex(path, GLIBC)
        for name in ("libembree3.so.3", "libtbb.so.12", "libtbbmalloc.so.2", "libjemalloc.so.2",
                     "libstdc++.so.6"):
            self.assertIn(name, inside)

    def test_bundle_libraries_are_its_own(self):
        for file in [*(self.bundle / "bin").iterdir(), *(self.bundle / "lib").iterdir()]:
            if file.parent.name == "bin":
                self.assertRegex(need("readelf", "-d", file),
                                 r"\(RPATH\).*\[\$ORIGIN/\.\./lib\]\n")
            for needed in re.findall(r"\(NEEDED\).*\[(.*)\]", need("readelf", "-d", file)):
                self.assertTrue((self.bundle / "lib" / needed).exists()
                                or GLIBC.search("/" + needed), f"{file.name} needs {needed}")

    def test_bundle_says_which_glibc(self):
        stated = re.search(r"glibc (\d+)\.(\d+) or later", (self.bundle / "README").read_text())
        stated = tuple(map(int, stated.groups()))
        wanted = (2, 0)
        for file in [*(self.bundle / "bin").iterdir(), *(self.bundle / "lib").iterdir()]:
            for a, b in re.findall(r"GLIBC_(\d+)\.(\d+)", need("readelf", "-V", file)):
                wanted = max(wanted, (int(a), int(b)))
        self.assertEqual(stated, wanted)
        self.assertLessEqual(wanted, (2, 36))  # Debian 12's

    def test_bundle_in_a_system_of_glibc_alone(self):
        """A root folder with the bundle, /proc, and three files of glibc."""
        root = self.folder / "root"
        for path in ("/lib64/ld-linux-x86-64.so.2", "/lib/x86_64-linux-gnu/libc.so.6",
                     "/lib/x86_64-linux-gnu/libm.so.6"):
            target = root / path.lstrip("/")
            target.parent.mkdir(parents=True, exist_ok=True)
            if not Path(path).exists():
                self.skipTest("glibc lies elsewhere on this system")
            shutil.copy(path, target)
        for name in ("proc", "data"):
            (root / name).mkdir(exist_ok=True)
        shutil.copy(self.scan, root / "data/scan.ply")
        shutil.copytree(self.bundle, root / "opt/rattan")
        words = "mount -t proc proc {0}/proc && exec chroot {0} /opt/rattan/bin/rattan".format(root)
        shell = ["unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork", "sh", "-c",
                 words + ' "$@"', "sh"]
        if run("unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork", "sh", "-c",
               f"mount -t proc proc {root}/proc").returncode != 0:
            self.skipTest("the kernel gives no user namespaces here")
        need(*shell, "remesh", "/data/scan.ply", "-o", "/data/out.drc", "--quiet", "--preview",
             "/data/out.png")
        self.assertEqual((root / "data/out.drc").read_bytes(), self.expected.read_bytes())

    def test_licences(self):
        text = need(self.bundle / "bin/rattan", "--licenses")
        self.assertIn("Permission is hereby granted", text)
        texts = self.bundle / "share/doc/rattan/licenses"
        self.assertIn(str(texts), text)
        listed = set(re.findall(r"^(\S+) +\S+ +\S", text.split("uses these libraries")[1], re.M))
        for name in listed & {p.name for p in texts.iterdir()}:
            self.assertGreater((texts / name).stat().st_size, 500)
        if not shutil.which("dpkg-query"):
            self.skipTest("dpkg-query is missing")
        self.assertLessEqual({"libhdf5-dev", "libeigen3-dev", "libcli11-dev"}, listed)
        for line in need("ldd", RATTAN).splitlines():
            path = re.search(r"(/\S+\.so\S*)", line)
            if not path:
                continue
            found = [run("dpkg-query", "-S", p).stdout for p in
                     (path[1], os.path.realpath(path[1]), "/usr" + path[1])]
            owner = next(f for f in found if f).split(":")[0]
            self.assertIn(owner, listed)
            self.assertTrue((texts / owner).exists())


if __name__ == "__main__":
    unittest.main()
