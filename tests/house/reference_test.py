#!/usr/bin/env python3
"""Policy: scripts/check-reference fails on a copy of this checkout with undocumented public names, and reports each.
Exits with 77 (skipped) without doxygen."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
PLANTED = """#pragma once

namespace legopt {

/// With a word.
struct SaidStruct {
  int said = 0;  ///< with a word
  int unsaid_member = 0;
  void UnsaidFunction() const;

 private:
  int own_affair_ = 0;
};

struct UnsaidStruct {
  int said = 0;  ///< with a word
};

/// With a word.
enum class SaidEnum {
  kSaid,  ///< with a word
  kUnsaid,
};

inline constexpr int kUnsaidConstant = 1;
void UnsaidFree();  // two strokes are for who reads the source

}  // namespace legopt
"""
NAMES = ("unsaid_member", "UnsaidFunction()", "UnsaidStruct", "kUnsaid ", "kUnsaidConstant", "UnsaidFree()")


class ReferenceTest(unittest.TestCase):
    def test_names_without_a_word_are_named(self):
        with tempfile.TemporaryDirectory() as copy:
            for folder in ("words", "legopt", "bus", "docs", "lcmtypes"):
                shutil.copytree(os.path.join(ROOT, folder), os.path.join(copy, folder))
            with open(os.path.join(copy, "legopt", "planted.h"), "w", encoding="utf-8") as file:
                file.write(PLANTED)
            check = os.path.join(ROOT, "scripts", "check-reference")
            result = subprocess.run([check, copy], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1, result.stderr)
        found = [line for line in result.stdout.splitlines() if line.startswith("legopt/planted.h:")]
        self.assertEqual(len(found), len(NAMES), result.stdout)
        for name in NAMES:
            self.assertTrue(any(name in line for line in found), f"{name}:\n{result.stdout}")


if __name__ == "__main__":
    if shutil.which("doxygen") is None:
        print("doxygen is missing (scripts/install-deps)", file=sys.stderr)
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *(f"ReferenceTest.{case}" for case in sys.argv[1:])])
