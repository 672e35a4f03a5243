"""The session of docs/reference/python.md, replayed, and the example."""

import contextlib
import doctest
import io
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import results

DOCUMENT = results.SOURCE / "docs" / "reference" / "python.md"
EXAMPLE = results.SOURCE / "examples" / "python" / "two_figures.py"
FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Digits of times, and the flag of contention, which depends on other load.
TIMES = re.compile(r"((?:_us|_ms)(?:_[ab])?': )[\d.]+|('contended': )(?:True|False)")


def masked(text):
    """Masks times, and removes spaces at line ends, which pandas prints and documents do not keep."""
    return re.sub(r" +$", "", TIMES.sub(lambda found: (found[1] or found[2]) + "#", text), flags=re.MULTILINE)


class Checker(doctest.OutputChecker):
    def check_output(self, want, got, optionflags):
        return super().check_output(masked(want), masked(got), optionflags)


class Session(unittest.TestCase):
    def test_every_line_says_what_the_document_says(self):
        folder = results.experiments().folder / "session"
        folder.mkdir()
        here = Path.cwd()
        self.addCleanup(os.chdir, here)
        os.chdir(folder)
        (folder / "examples").symlink_to(results.SOURCE / "examples")
        names, ran, left = {}, 0, []
        for kind, needs, text in FENCE.findall(DOCUMENT.read_text()):
            try:
                results.require(*needs.split())
                if kind == "console":
                    self.shell(text)
                else:
                    self.python(text, names)
                ran += 1
            except unittest.SkipTest as missing:
                left.append(str(missing))
        self.assertGreaterEqual(ran, 6)
        for reason in left:
            print(f"A BLOCK WAS LEFT OUT, {reason}", file=sys.stderr)

    def python(self, text, names):
        test = doctest.DocTestParser().get_doctest(text, names, "docs/reference/python.md", str(DOCUMENT), 0)
        said = io.StringIO()
        runner = doctest.DocTestRunner(Checker(), verbose=False)
        with contextlib.redirect_stdout(io.StringIO()):
            outcome = runner.run(test, out=said.write, clear_globs=False)
        names.update(test.globs)
        self.assertEqual(outcome.failed, 0, said.getvalue())
        self.assertGreater(outcome.attempted, 0)

    def shell(self, text):
        command, *printed = text.splitlines()
        self.assertTrue(command.startswith("$ "))
        if "two_figures" in command:
            results.require("matplotlib")
        environment = {**results.environment(), "PATH": f"{results.build()}:{os.environ['PATH']}",
                       "PYTHONPATH": os.pathsep.join([str(results.PACKAGE), os.environ.get("PYTHONPATH", "")]),
                       "LEGOPT_DATA": str(results.SOURCE / "data")}
        words = command[2:].split()
        if words[0] == "python3":
            words[:1] = [sys.executable, "-B"]
        done = subprocess.run(words, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        if printed:
            self.assertEqual(done.stdout.splitlines(), printed)

    def test_the_document_names_what_there_is(self):
        import legopt
        text = DOCUMENT.read_text()
        for name in dir(legopt.Database):
            if not name.startswith("_") and name not in ("close", "path"):
                self.assertIn(f"`{name}(", text)
        for name in ("pinocchio", "drake", "mujoco"):
            self.assertIn(f"`{name}(", text)


class Example(unittest.TestCase):
    def run_example(self, *arguments, **changes):
        environment = {**results.environment(), "LEGOPT": str(results.build() / "legopt"),
                       "PYTHONPATH": os.pathsep.join([str(results.PACKAGE), os.environ.get("PYTHONPATH", "")]), **changes}
        return subprocess.run([sys.executable, "-B", str(EXAMPLE), *map(str, arguments)], env=environment, text=True,
                              capture_output=True, stdin=subprocess.DEVNULL, check=False)

    def test_without_matplotlib_it_says_so(self):
        hiding = results.experiments().folder / "hiding"
        (hiding / "matplotlib").mkdir(parents=True)
        (hiding / "matplotlib" / "__init__.py").write_text("raise ImportError('no matplotlib')\n")
        done = self.run_example(results.experiments().backup, "LegOpt-best", "SQP:multi_starts=0",
                                PYTHONPATH=os.pathsep.join([str(hiding), str(results.PACKAGE)]))
        self.assertEqual(done.returncode, 1)
        self.assertIn("drawing needs matplotlib (no matplotlib); on Debian: apt install python3-matplotlib", done.stderr)
        self.assertEqual(done.stdout, "")

    def test_it_draws_both_figures(self):
        results.require("matplotlib")
        made = results.experiments()
        out = made.folder / "figures"
        done = self.run_example(made.backup, "LegOpt-best", "SQP:multi_starts=0", "--experiment", "first", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({path.name for path in out.iterdir()}, {"profiles.svg", "profiles.png", "pairs.svg", "pairs.png"})
        for path in out.glob("*.png"):
            self.assertTrue(path.read_bytes().startswith(b"\x89PNG"))
        for path in out.glob("*.svg"):
            self.assertIn("<svg", path.read_text())
        for arguments, text in ((("none.sqlite", "A", "B"), "no such database"), ((made.backup, "A", "B"), "no method 'A'")):
            done = self.run_example(*arguments, "--out", out)
            self.assertEqual(done.returncode, 1)
            self.assertIn("two_figures: ", done.stderr)
            self.assertIn(text, done.stderr)
