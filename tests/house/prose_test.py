#!/usr/bin/env python3
"""scripts/check-prose on small repositories: the exit code follows the rate, and each pattern is found."""
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
CLEAR = "// Number of rows of the constraint matrix.\n" * 200
RIDDLES = {
    "comment without a noun": "int rows;  ///< of the matrix\n",
    "clause in place of a noun": "// Keeps what is left of the budget.\n",
    "nobody, somebody, whoever": "// A file that nobody reads.\n",
    "code that is told or speaks": "// The worker is told to stop.\n",
    "code with manners or knowledge": "// The scheduler knows nothing of sockets.\n",
    "things of others": "// Starts solvers of others.\n",
    "trailing too": "// Reads certificates, too.\n",
    "idiom": "// The job is given back.\n",
    "inverted sentence": "// Equal are jobs with one hash.\n",
}


class ProseTest(unittest.TestCase):
    def check(self, files, *flags):
        """Exit code and output for a repository with these files."""
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["git", "init", "-q", folder], check=True)
            for path, text in files.items():
                os.makedirs(os.path.dirname(os.path.join(folder, path)), exist_ok=True)
                with open(os.path.join(folder, path), "w", encoding="utf-8") as file:
                    file.write(text)
            subprocess.run(["git", "-C", folder, "add", "."], check=True)
            result = subprocess.run([os.path.join(ROOT, "scripts", "check-prose"), *flags, folder], capture_output=True, text=True)
        return result.returncode, result.stdout

    def test_clear_prose_passes(self):
        code, output = self.check({"bus/codec.h": CLEAR})
        self.assertEqual(code, 0, output)
        self.assertIn("     0  in 200 lines of prose: 0.0 per thousand", output)

    def test_each_pattern_is_found(self):
        for name, line in RIDDLES.items():
            with self.subTest(name):
                code, output = self.check({"bus/codec.h": line}, "--list")
                self.assertEqual(code, 1, output)
                self.assertIn(f"bus/codec.h:1: [{name}]", output)

    def test_the_rate_of_the_tree_has_a_limit(self):
        code, output = self.check({"bus/codec.h": CLEAR + RIDDLES["idiom"] * 2})
        self.assertEqual(code, 0, output)
        code, output = self.check({"bus/codec.h": CLEAR + RIDDLES["idiom"] * 3})
        self.assertEqual(code, 1, output)

    def test_the_rate_of_a_folder_has_a_limit(self):
        code, output = self.check({"bus/codec.h": CLEAR * 9, "db/store.h": CLEAR + RIDDLES["idiom"] * 5})
        self.assertEqual(code, 1, output)
        self.assertIn("db: 24.4 per thousand", output)

    def test_code_is_no_prose(self):
        code, output = self.check({"bus/codec.h": CLEAR + "int of_nobody = given_back;\nconst char* a = \"what is\";\n"})
        self.assertEqual(code, 0, output)
        self.assertIn("     0  in 200 lines", output)


if __name__ == "__main__":
    unittest.main()
