#!/usr/bin/env python3
"""Policy: this checkout obeys the table of permitted dependencies, and scripts/check-arrows fails on a copy with a
planted fault. arrows_test.py CASE"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
ROOMS = ("words", "files", "lcmtypes", "legopt", "bus", "bridge", "db", "programs", "server", "worker", "client")


class ArrowsTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.copy = scratch.name
        for room in ROOMS:
            shutil.copytree(os.path.join(ROOT, room), os.path.join(self.copy, room))
        os.mkdir(os.path.join(self.copy, "docs"))
        shutil.copy(os.path.join(ROOT, "docs", "architecture.md"), os.path.join(self.copy, "docs"))

    def check(self):
        """Returns the output of the script for the copy; empty on success."""
        result = subprocess.run([os.path.join(ROOT, "scripts", "check-arrows"), self.copy], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1 if result.stdout else 0, result.stderr)
        return result.stdout

    def plant(self, path, text):
        os.makedirs(os.path.dirname(os.path.join(self.copy, path)), exist_ok=True)
        with open(os.path.join(self.copy, path), "a", encoding="utf-8") as file:
            file.write(text)

    def edit_table(self, old, new):
        path = os.path.join(self.copy, "docs", "architecture.md")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.assertIn(old, text)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text.replace(old, new))

    def test_every_include_follows_an_arrow(self):
        self.assertEqual(self.check(), "")

    def test_an_optimiser_that_knows_robots_is_named(self):
        self.plant("legopt/solvers/sqp_solver.cpp", '#include "legopt/robot/robot_model.h"\n')
        self.assertRegex(self.check(), r"^legopt/solvers/sqp_solver.cpp:\d+: `legopt/solvers/` may not use `legopt/robot/`")

    def test_a_generated_header_counts_as_its_room(self):
        self.plant("db/records.h", '#include "legopt_msg/lease.hpp"\n')
        self.assertIn("`db/` may not use `lcmtypes/`", self.check())

    def test_a_folder_without_a_row_is_named(self):
        self.plant("utils/strings.h", "#pragma once\n")
        self.assertIn("no row for `utils/`", self.check())

    def test_a_circle_of_arrows_is_named(self):
        self.edit_table("| `legopt/robot/` | `legopt/input/` |", "| `legopt/robot/` | `legopt/planning/` |")
        self.assertIn("in a circle", self.check())

    def test_a_row_that_leads_nowhere_is_named(self):
        self.edit_table("| `legopt/robot/` | `legopt/input/` |", "| `legopt/robot/` | `legopt/nowhere/` |")
        self.assertIn("which has no row", self.check())


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + [f"ArrowsTest.{case}" for case in sys.argv[1:]])
