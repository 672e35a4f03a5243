#!/usr/bin/env python3
"""Policy: scripts/check-tidy finds a defect planted in a small checkout, in a source or in a header, committed or not,
and checks nothing else. tidy_test.py CASE"""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
GOOD = "namespace bus {\nint Twice(int number) { return 2 * number; }\n}  // namespace bus\n"
MOVED = """#include <string>
#include <utility>
namespace bus {
std::string Kept(std::string text) {
  std::string other = std::move(text);
  return other + text;
}
}  // namespace bus
"""
UNSET = "#pragma once\nnamespace bus {\nstruct Window {\n  Window() {}\n  int size;\n};\n}  // namespace bus\n"


class TidyTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.root = os.path.realpath(scratch.name)
        os.mkdir(os.path.join(self.root, "scripts"))
        shutil.copy(os.path.join(ROOT, "scripts", "check-tidy"), os.path.join(self.root, "scripts"))
        shutil.copy(os.path.join(ROOT, ".clang-tidy"), self.root)
        self.git("init", "-q")
        self.plant("bus/good.cpp", GOOD)
        os.mkdir(os.path.join(self.root, "commands"))
        self.write_commands("bus/good.cpp")
        if self.check().returncode == 77:
            self.skipTest("scripts/check-tidy has nothing to check with")

    def git(self, *arguments):
        subprocess.run(["git", "-c", "user.name=n", "-c", "user.email=n@example.org", *arguments], cwd=self.root, check=True)

    def plant(self, name, text, commit=True):
        path = os.path.join(self.root, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        if commit:
            self.git("add", name)
            self.git("commit", "-q", "-m", name)

    def write_commands(self, *names):
        commands = [{"directory": self.root, "file": os.path.join(self.root, name),
                     "command": f"c++ -std=c++20 -Werror -Wno-restrict -I{self.root} -c {os.path.join(self.root, name)}"}
                    for name in names]
        with open(os.path.join(self.root, "commands", "compile_commands.json"), "w", encoding="utf-8") as file:
            json.dump(commands, file)

    def check(self, *arguments, environment=None):
        return subprocess.run([os.path.join(self.root, "scripts", "check-tidy"), "--build", "commands", *arguments],
                              cwd=self.root, capture_output=True, text=True, env={**os.environ, **(environment or {})})

    def test_what_is_clean_passes_and_is_remembered(self):
        again = self.check()
        self.assertEqual(again.returncode, 0, again.stdout + again.stderr)
        self.assertIn("0 files checked, 1 clean as before", again.stderr)

    def test_a_planted_defect_is_an_error_in_a_commit(self):
        self.plant("bus/moved.cpp", MOVED)
        self.write_commands("bus/good.cpp", "bus/moved.cpp")
        found = self.check()
        self.assertEqual(found.returncode, 1, found.stdout + found.stderr)
        self.assertRegex(found.stdout, r"^bus/moved.cpp:6:18: error: 'text' used after it was moved \[bugprone-use-after-move")

    def test_a_planted_defect_is_an_error_before_it_is_committed(self):
        self.plant("bus/good.cpp", MOVED, commit=False)
        self.assertIn("bugprone-use-after-move", self.check().stdout)

    def test_a_header_is_checked_though_no_source_includes_it(self):
        self.plant("bus/window.h", UNSET)
        found = self.check()
        self.assertEqual(found.returncode, 1, found.stdout + found.stderr)
        self.assertRegex(found.stdout, r"^bus/window.h:4:3: error: constructor does not initialize these fields: size")

    def test_a_source_is_checked_again_when_a_header_of_it_changed(self):
        self.plant("bus/window.h", "#pragma once\n")
        self.plant("bus/good.cpp", '#include "bus/window.h"\n' + GOOD)
        self.assertEqual(self.check("bus/good.cpp").returncode, 0)
        self.plant("bus/window.h", UNSET)
        self.assertIn("bus/window.h:4:3", self.check("bus/good.cpp").stdout)

    def test_only_what_the_main_branch_does_not_have_is_checked(self):
        self.plant("bus/moved.cpp", MOVED)
        self.git("update-ref", "refs/remotes/origin/main", "HEAD")
        self.plant("bus/other.cpp", GOOD)
        self.write_commands("bus/good.cpp", "bus/moved.cpp", "bus/other.cpp")
        later = self.check()
        self.assertEqual(later.returncode, 0, later.stdout)
        self.assertIn("1 files checked, 0 clean", later.stderr)
        self.assertEqual(self.check("--all").returncode, 1)

    def test_a_bound_counts_what_it_leaves(self):
        for name in ("one", "two", "three"):
            self.plant(f"bus/{name}.h", "#pragma once\n")
        self.assertIn("1 files checked, 1 clean as before, 2 left", self.check("--most", "1").stderr)

    def test_a_source_that_no_program_here_has_is_counted(self):
        self.plant("bus/good.cpp", GOOD + "\n")
        self.plant("examples/other.cpp", MOVED)
        found = self.check()
        self.assertEqual(found.returncode, 0, found.stdout + found.stderr)
        self.assertIn("1 files checked, 0 clean as before, 0 left, 1 not of this build, 0 findings", found.stderr)

    def test_without_clang_tidy_it_is_skipped_and_in_continuous_integration_it_fails(self):
        tools = os.path.join(self.root, "tools")
        os.mkdir(tools)
        for tool, path in (("python3", sys.executable), ("git", shutil.which("git")), ("env", shutil.which("env"))):
            os.symlink(path, os.path.join(tools, tool))
        self.assertEqual(self.check(environment={"PATH": tools, "CI": ""}).returncode, 77)
        self.assertEqual(self.check(environment={"PATH": tools, "CI": "true"}).returncode, 1)


if __name__ == "__main__":
    program = unittest.main(argv=[sys.argv[0]] + [f"TidyTest.{case}" for case in sys.argv[1:]], exit=False)
    if program.result.skipped:
        sys.exit(77)
    sys.exit(0 if program.result.wasSuccessful() else 1)
