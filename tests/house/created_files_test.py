#!/usr/bin/env python3
"""Policy: sources of this checkout create files only through legopt/files/, and scripts/check-created-files names violations.
created_files_test.py CASE"""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))


def check(*folder):
    return subprocess.run([os.path.join(ROOT, "scripts", "check-created-files"), *folder], capture_output=True, text=True)


class CreatedFilesTest(unittest.TestCase):
    def test_every_file_is_created_by_one_module(self):
        result = check()
        self.assertEqual((result.returncode, result.stdout), (0, ""))

    def test_a_file_that_is_created_elsewhere_is_named(self):
        for line in ("std::ofstream stream(path);", "open(path, O_RDWR | O_CREAT, 0644);", 'std::fopen(path, "w");',
                     "fs::copy_file(from, to);", "mkstemp(name);"):
            with self.subTest(line), tempfile.TemporaryDirectory() as scratch:
                os.mkdir(os.path.join(scratch, "db"))
                with open(os.path.join(scratch, "db", "planted.cpp"), "w", encoding="utf-8") as file:
                    file.write("int first;\n" + line + "\n")
                result = check(scratch)
                self.assertEqual(result.returncode, 1)
                self.assertIn("db/planted.cpp:2: ", result.stdout)

    def test_reading_and_dev_null_are_allowed(self):
        with tempfile.TemporaryDirectory() as scratch:
            os.mkdir(os.path.join(scratch, "db"))
            with open(os.path.join(scratch, "db", "sound.cpp"), "w", encoding="utf-8") as file:
                file.write('std::ifstream stream(path);  // not std::ofstream\nstd::fopen("/dev/null", "w");\n')
            self.assertEqual(check(scratch).returncode, 0)


if __name__ == "__main__":
    import sys
    unittest.main(argv=[sys.argv[0]] + [f"CreatedFilesTest.{case}" for case in sys.argv[1:]])
