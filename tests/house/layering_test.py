#!/usr/bin/env python3
"""scripts/check-layering accepts this checkout and finds faults planted in a copy of it. layering_test.py CASE"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
FOLDERS = ("lcmtypes", "legopt", "bus", "db", "app", "server", "worker", "client")


class LayeringTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.copy = scratch.name
        for folder in FOLDERS:
            shutil.copytree(os.path.join(ROOT, folder), os.path.join(self.copy, folder))
        folder = os.path.join("docs", "explanation")
        os.makedirs(os.path.join(self.copy, folder))
        shutil.copy(os.path.join(ROOT, folder, "architecture.md"), os.path.join(self.copy, folder))

    def check(self):
        """Output of the script for the copy."""
        script = os.path.join(ROOT, "scripts", "check-layering")
        result = subprocess.run([script, self.copy], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1 if result.stdout else 0, result.stderr)
        return result.stdout

    def plant(self, path, text):
        os.makedirs(os.path.dirname(os.path.join(self.copy, path)), exist_ok=True)
        with open(os.path.join(self.copy, path), "a", encoding="utf-8") as file:
            file.write(text)

    def edit_table(self, old, new):
        path = os.path.join(self.copy, "docs", "explanation", "architecture.md")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.assertIn(old, text)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text.replace(old, new))

    def test_this_checkout_follows_the_table(self):
        self.assertEqual(self.check(), "")

    def test_a_solver_that_includes_robots_is_reported(self):
        self.plant("legopt/solvers/internal/sqp_solver.cpp", '#include "legopt/robot/robot_model.h"\n')
        self.assertRegex(self.check(), r"^legopt/solvers/internal/sqp_solver.cpp:\d+: `legopt/solvers/` may not include `legopt/robot/`")

    def test_a_generated_header_belongs_to_its_module(self):
        self.plant("db/records.h", '#include "legopt_msg/lease.hpp"\n')
        self.assertIn("`db/` may not include `lcmtypes/`", self.check())

    def test_a_folder_without_a_row_is_reported(self):
        self.plant("utils/strings.h", "#pragma once\n")
        self.assertIn("no row for `utils/`", self.check())

    def test_a_cycle_is_reported(self):
        self.edit_table("| `legopt/robot/` | `legopt/input/` ", "| `legopt/robot/` | `legopt/planning/` ")
        self.assertIn("in a cycle", self.check())

    def test_an_unknown_module_is_reported(self):
        self.edit_table("| `legopt/robot/` | `legopt/input/` ", "| `legopt/robot/` | `legopt/nowhere/` ")
        self.assertIn("which has no row", self.check())


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + [f"LayeringTest.{case}" for case in sys.argv[1:]])
