#!/usr/bin/env python3
"""Policy: this checkout reads and writes untrusted text only by its own readers, and scripts/check-readers names each
other call. readers_test.py CASE"""
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))


def check(folder):
    result = subprocess.run([os.path.join(ROOT, "scripts", "check-readers"), folder], capture_output=True, text=True)
    return result.returncode, result.stdout


class ReadersTest(unittest.TestCase):
    def faults_of(self, line, path="client/a.cpp"):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, os.path.dirname(path)))
            with open(os.path.join(folder, path), "w", encoding="utf-8") as file:
                file.write("#include <string>\n" + line + "\n")
            return check(folder)[1]

    def test_this_checkout_is_clean(self):
        self.assertEqual(check(ROOT), (0, ""))

    def test_other_calls_are_named(self):
        for line in ("YAML::Load(text);", "YAML::LoadFile(path);", "auto a = json::parse(b);", "nlohmann::json::parse(b)",
                     "Json::accept(b)", "nlohmann::ordered_json::parse(b)", "a.dump();", "a->dump(2);"):
            self.assertIn("client/a.cpp:2: ", self.faults_of(line), line)

    def test_the_readers_may_call_the_parsers(self):
        self.assertEqual(self.faults_of("YAML::Load(text);", "legopt/input/yaml.cpp"), "")
        self.assertIn("yaml.cpp:2", self.faults_of("json::parse(text);", "legopt/input/yaml.cpp"))

    def test_numbers_that_follow_the_locale_are_named(self):
        for line in ("std::stod(text)", "::strtod(text, nullptr)", "std::sscanf(a, b)", "atof(x)", 'std::snprintf(a, n, "%.3f s", x);', 'Print("%g", x)', 'Print("%8.4g", x)', 'Print("%.1e", x)',
                     'Print("%.*g", 3, x)', "std::ostringstream text;", "std::istringstream in(text);",
                     "std::stringstream both;"):
            self.assertIn("client/a.cpp:2: ", self.faults_of(line), line)

    # They skip blanks, ignore text after the number, and some read 010 as 8.
    def test_readers_of_whole_numbers_that_take_other_text_are_named(self):
        for line in ("std::stoll(x)", "stoi(x)", "atoi(x)", "std::strtol(x, &end, 10)", "::strtoull(x, nullptr, 0)"):
            self.assertIn("client/a.cpp:2: ", self.faults_of(line), line)

    def test_other_readers_of_json_in_python_are_named(self):
        self.assertIn("database.py:2: ", self.faults_of("names = json.loads(text)", "python/legopt/database.py"))
        self.assertEqual(self.faults_of("value = json.loads(text)", "python/legopt/json_text.py"), "")

    def test_what_depends_on_no_locale_passes(self):
        for line in ('Pattern("%H:%M:%S.%e")', 'std::snprintf(a, n, "%d %s %zu", x)', '"100 %"',
                     "FormatFixed(x, 3)", "std::to_string(count)", "std::string dump(text);"):
            self.assertEqual(self.faults_of(line), "", line)

    def test_a_line_with_a_reason_passes(self):
        self.assertEqual(self.faults_of("a.dump();  // reader: the value was made here"), "")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + ["ReadersTest." + case for case in sys.argv[1:]])
