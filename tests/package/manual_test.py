# SPDX-License-Identifier: MIT
"""Help screens, manual page and completion of every command there is: they fit their screens, and
each option of the full help is in all of them."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

RATTAN = os.environ["RATTAN"]
PROGRAMS = [RATTAN, str(Path(RATTAN).with_name("rattan-bench"))]
HELP = {("-h", "--help"), ("--help-all",)}  # described once for all commands
PLACEHOLDERS = {"TEXT", "INT", "UINT", "FLOAT", "ENUM"}


def output(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=60)
    if done.returncode != 0 or done.stderr:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stderr}")
    return done.stdout


def commands(program):
    """Names below the heading Commands; one empty name of a program without commands."""
    part = re.search(r"^Commands:\n((?:  .*\n)+)", output(program, "--help"), re.M)
    return re.findall(r"^  (\S+)", part[1], re.M) if part else [""]


def options(screen):
    """Of a help screen: {all names of an option: its value, or nothing}."""
    found = {}
    for line in re.findall(r"^  (-.*)$", screen, re.M):
        names, value = re.match(r"((?:--?[\w-]+(?:, )?)+)(?: (\S+))?", line).groups()
        # The text stands behind two spaces, the value behind one.
        value = value if value and not re.match(re.escape(names) + "  ", line) else None
        found[tuple(names.strip().split(", "))] = value
    return found


class Manual(unittest.TestCase):
    def every(self):
        """Each program and command with the options of its full help."""
        for program in PROGRAMS:
            for command in commands(program):
                words = [program, command] if command else [program]
                found = options(output(*words, "--help-all"))
                self.assertGreater(len(found), 1)
                yield program, command, words, found

    def test_program_fits_a_terminal(self):
        lines = output(RATTAN, "--help").splitlines()
        self.assertLessEqual(len(lines), 24)
        self.assertLessEqual(max(map(len, lines)), 80)
        self.assertIn("remesh", commands(RATTAN))
        for line in lines:
            self.assertFalse(line.rstrip() != line, "space at the end of a line")

    def test_commands_fit_a_screen(self):
        for _, command, words, found in self.every():
            lines = output(*words, "--help").splitlines()
            self.assertLessEqual(len(lines), 50, f"{words}: mark options with more()")
            self.assertLessEqual(max(map(len, lines)), 100, words)
            self.assertEqual(output(*words, "-h").splitlines(), lines)
            short = options("\n".join(lines) + "\n")
            self.assertLessEqual(set(short), set(found))
            hidden = set(found) - set(short) - HELP
            told = re.match(r"(\d+) more options: ", lines[-1])
            self.assertEqual(int(told[1]) if told else 0, len(hidden), hidden)

    def test_values_have_names(self):
        for _, _, words, found in self.every():
            for names, value in found.items():
                self.assertNotIn((value or "").rstrip("."), PLACEHOLDERS,
                                 f"{words} {names}: give it a type_name()")
            self.assertNotIn("->", output(*words, "--help-all"))

    def test_unknown_options_are_refused(self):
        for program in PROGRAMS:
            done = subprocess.run([program, "--generate", "pdf"], capture_output=True, text=True)
            self.assertNotEqual(done.returncode, 0)

    def test_manual_page(self):
        for program in PROGRAMS:
            page = output(program, "--generate", "man")
            self.assertNotIn("\n\n", page)  # blank lines are not for roff
            plain = page.replace("\\-", "-")
            sections = re.split(r"(?m)^\.S[SH] ", plain)
            for command in commands(program):
                name = f"{Path(program).name} {command}".strip()
                section = next(s for s in sections
                               if s.startswith(name + "\n" if command else "OPTIONS\n"))
                found = set(options(output(program, *([command] if command else []), "--help-all")))
                for names in found - HELP if command else found:
                    for option in names:
                        self.assertIn(f"\\fB{option}\\fR", section)
            for line in plain.splitlines():
                if line.startswith(("'", ".")):
                    self.assertRegex(line, r"^\.(TH|SH|SS|TP|PP|br|RS|RE|nf|fi)\b")
            if shutil.which("man"):
                done = subprocess.run(["man", "--warnings", "-l", "-"], input=page, text=True,
                                      capture_output=True, env={**os.environ, "LC_ALL": "C.UTF-8"})
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def complete(self, script, *line):
        """What bash offers for the last word."""
        program = line[0]
        words = " ".join(f"'{w}'" for w in line)
        done = subprocess.run(
            ["bash", "-c", f"compopt() {{ :; }}; source {script}; COMP_WORDS=({words}); "
             f"COMP_CWORD={len(line) - 1}; $(complete -p {program} | sed 's/.*-F //; s/ .*//'); "
             "printf '%s\\n' \"${COMPREPLY[@]}\""], capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return set(done.stdout.split())

    def test_bash(self):
        with tempfile.TemporaryDirectory(prefix="rattan-test.") as folder:
            scripts = {}
            for program in PROGRAMS:
                scripts[program] = Path(folder) / Path(program).name
                scripts[program].write_text(output(program, "--generate", "bash"))
            self.assertLessEqual(set(commands(RATTAN)),
                                 self.complete(scripts[RATTAN], "rattan", ""))
            self.assertEqual(self.complete(scripts[RATTAN], "rattan", "rem"), {"remesh"})
            for program, command, words, found in self.every():
                line = [Path(program).name, *words[1:]]
                names = {n for option in found for n in option}
                self.assertEqual(self.complete(scripts[program], *line, "-"), names)
                for option, value in found.items():
                    if value and re.fullmatch(r"\w+(\|\w+)+", value):
                        self.assertEqual(self.complete(scripts[program], *line, option[-1], ""),
                                         set(value.split("|")))

    def test_files_are_offered(self):
        with tempfile.TemporaryDirectory(prefix="rattan-test.") as folder:
            script = Path(folder) / "script"
            script.write_text(output(RATTAN, "--generate", "bash"))
            (Path(folder) / "scan.ply").touch()
            (Path(folder) / "deep").mkdir()
            for before in (["remesh"], ["remesh", "-o"], ["compare", "--json"]):
                self.assertEqual(
                    self.complete(script, "rattan", *before, f"{folder}/s"),
                    {f"{folder}/scan.ply", f"{folder}/script"})
            self.assertEqual(self.complete(script, "rattan", "remesh", "--work-dir", f"{folder}/"),
                             {f"{folder}/deep"})

    def test_zsh_and_fish(self):
        for shell in ("zsh", "fish"):
            for program in PROGRAMS:
                script = output(program, "--generate", shell)
                for command in commands(program):
                    for names in options(output(program, *([command] if command else []),
                                                "--help-all")):
                        for name in names:
                            self.assertIn(name if shell == "zsh" else
                                          (" -l " + name[2:] if name[1] == "-" else " -s " + name[1:]),
                                          script)
                if shutil.which(shell):
                    done = subprocess.run([shell, "-n"], input=script, text=True,
                                          capture_output=True)
                    self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
