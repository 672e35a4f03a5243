#!/usr/bin/env python3
"""scripts/check-reference on copies of this checkout with planted names. Exits with 77 (skipped) without doxygen."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
CLEAN = """#pragma once

namespace legopt {

/// Limits of a planted search.
struct PlantedLimits {
  PlantedLimits();
  ~PlantedLimits();
  int max_iterations = 0;
  double tolerance_m = 1e-3;  ///< largest distance to the surface
  bool IsFinite() const;
  bool operator==(const PlantedLimits& other) const;

 private:
  void Check(int iteration);
};

/// Outcome of a planted search.
enum class PlantedOutcome {
  kFound,
  kNotFound,
};

inline constexpr int kMaxPlanted = 1;
int CountPlanted();

}  // namespace legopt
"""
FAULTY = """#pragma once

namespace legopt {

struct PlantedUndocumented {};

/// A planted repetition.
struct PlantedRepetition {
  int num_rows = 0;  ///< the num rows
  void Resize(int rows);
};

enum class PlantedEnum { kFirst };

void SearchPlanted(int start);  // two slashes are no documentation

}  // namespace legopt
"""
FOUND = (
    "struct legopt::PlantedUndocumented has no comment",
    "the comment of struct legopt::PlantedRepetition only repeats the name",
    "the comment of legopt::PlantedRepetition::num_rows only repeats the name",
    "function legopt::PlantedRepetition::Resize has no comment",
    "enum legopt::PlantedEnum has no comment",
    "function legopt::SearchPlanted has no comment",
)


class ReferenceTest(unittest.TestCase):
    def lines_about(self, text):
        """Output lines about a header with this text."""
        with tempfile.TemporaryDirectory() as copy:
            for folder in ("legopt", "bus", "docs", "lcmtypes"):
                shutil.copytree(os.path.join(ROOT, folder), os.path.join(copy, folder))
            with open(os.path.join(copy, "legopt", "planted.h"), "w", encoding="utf-8") as file:
                file.write(text)
            check = os.path.join(ROOT, "scripts", "check-reference")
            result = subprocess.run([check, copy], capture_output=True, text=True)
        found = [line for line in result.stdout.splitlines() if line.startswith("legopt/planted.h:")]
        self.assertEqual(result.returncode, 1 if result.stdout else 0, result.stderr)
        return found

    def test_undocumented_and_repeating_names_are_reported(self):
        found = self.lines_about(FAULTY)
        self.assertEqual(len(found), len(FOUND), found)
        for message in FOUND:
            self.assertTrue(any(message in line for line in found), f"{message}:\n{found}")

    def test_names_that_explain_themselves_pass(self):
        self.assertEqual(self.lines_about(CLEAN), [])


if __name__ == "__main__":
    if shutil.which("doxygen") is None:
        print("doxygen is missing (scripts/install-deps)", file=sys.stderr)
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *(f"ReferenceTest.{case}" for case in sys.argv[1:])])
