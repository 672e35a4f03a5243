#!/usr/bin/env python3
"""Policy: scripts/test-summary counts each test once, and no failure is lost. summary_test.py"""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
PASSED = '<testcase name="{}" classname="Suite" status="run" result="completed"/>'
FAILED = '<testcase name="{}" classname="Suite" status="run" result="completed"><failure message="no"/></testcase>'
SKIPPED = '<testcase name="{}" classname="Suite" status="run" result="skipped"><skipped message="file:1&#x0A;no data"/></testcase>'


def suite(*cases):
    return "<testsuites><testsuite>" + "".join(text.format(name) for text, name in cases) + "</testsuite></testsuites>"


def entry(name, status="run", more=""):
    return f'<testcase name="{name}" time="1.5" status="{status}">{more}</testcase>'


class SummaryTest(unittest.TestCase):
    def summary(self, entries, results=None):
        with tempfile.TemporaryDirectory() as build:
            os.mkdir(os.path.join(build, "test-results"))
            with open(os.path.join(build, "test-results.xml"), "w", encoding="utf-8") as file:
                file.write("<testsuite>" + "".join(entries) + "</testsuite>")
            for name, text in (results or {}).items():
                with open(os.path.join(build, "test-results", name + ".xml"), "w", encoding="utf-8") as file:
                    file.write(text)
            done = subprocess.run([os.path.join(ROOT, "scripts", "test-summary"), build], capture_output=True, text=True)
            self.assertEqual(done.stderr, "")
            return done.returncode, done.stdout

    def test_the_tests_of_a_suite_are_counted_one_by_one(self):
        code, text = self.summary([entry("a_test.Suite"), entry("Script")],
                                  {"a_test.Suite": suite((PASSED, "One"), (PASSED, "Two"), (SKIPPED, "Three"))})
        self.assertEqual(text.splitlines()[-1], "3 passed, 0 failed, 1 skipped")
        self.assertIn("skipped, no data: Suite.Three", text)
        self.assertEqual(code, 0)

    def test_a_failure_within_a_suite_is_named(self):
        code, text = self.summary([entry("a_test.Inst/Suite", "fail")],
                                  {"a_test.Inst_Suite": suite((PASSED, "One"), (FAILED, "Two"))})
        self.assertIn("failed: Suite.Two", text)
        self.assertEqual(text.splitlines()[-1], "1 passed, 1 failed, 0 skipped")
        self.assertEqual(code, 1)

    def test_a_suite_that_ended_early_is_a_failure(self):
        for results in ({}, {"a_test.Suite": suite((PASSED, "One"))}):
            code, text = self.summary([entry("a_test.Suite", "fail")], results)
            self.assertEqual(text.splitlines()[-1], "0 passed, 1 failed, 0 skipped")
            self.assertEqual(code, 1)

    def test_nothing_passed_is_no_success(self):
        code, text = self.summary([entry("Script", "notrun", "<skipped/><system-out>needs root</system-out>")])
        self.assertEqual((code, text.splitlines()[-1]), (1, "0 passed, 0 failed, 1 skipped"))
        self.assertIn("skipped, needs root: Script", text)


if __name__ == "__main__":
    unittest.main()
