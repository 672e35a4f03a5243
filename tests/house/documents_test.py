#!/usr/bin/env python3
"""scripts/check-documents accepts a small sound repository and reports each fault planted in it. documents_test.py"""
import os
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
FILES = {
    "README.md": "# Project\n\n[Guide](docs/guide.md#first-step)\n",
    "docs/guide.md": "# Guide\n\n## First step\n\n| a | b |\n| --- | --- |\n| few | words |\n\n[Readme](../README.md)\n",
    "mkdocs.yml": "nav:\n  - Guide: guide.md\n  - Readme: repository/README.md\n",
    "CITATION.cff": "version: 1.2.3\n",
    "CMakeLists.txt": "project(legopt VERSION 1.2.3)\n",
    "source.h": "/// As in docs/guide.md#first-step.\n",
}
FAULTS = (  # file, new text, line of the output
    ("docs/guide.md", "[No](nothing.md)\n", "docs/guide.md:1: there is no docs/nothing.md"),
    ("docs/guide.md", "[No](#second-step)\n", "docs/guide.md:1: docs/guide.md has no heading #second-step"),
    ("docs/guide.md", "[No](../../secret.md)\n", "docs/guide.md:1: leads out of the repository"),
    ("docs/guide.md", "| " + "word " * 26 + "|\n", "docs/guide.md:1: a cell has 26 words, 25 at most"),
    ("docs/other.md", "# Other\n", "mkdocs.yml:1: the navigation does not name other.md"),
    ("mkdocs.yml", "nav:\n  - A: guide.md\n  - B: guide.md\n", "mkdocs.yml:3: names guide.md twice"),
    ("mkdocs.yml", "nav:\n  - A: guide.md\n  - B: b.md\n", "mkdocs.yml:3: there is no docs/b.md"),
    ("README.md", "word " * 701, "README.md:1: has 701 words, 700 at most"),
    ("CITATION.cff", "version: 1.2.4\n", "CITATION.cff:1: version 1.2.4, and 1.2.3 in CMakeLists.txt"),
    ("results/page.md", "    legopt generate dataset --kind garage --seed 4026 --out F\n",
     "results/page.md:1: seed 4026 is not in results/seeds.md"),
    ("source.h", "/// See docs/absent.md.\n", "source.h:1: there is no docs/absent.md"),
    ("source.h", "/// See results/absent.md.\n", "source.h:1: there is no results/absent.md"),
)


class DocumentsTest(unittest.TestCase):
    def output_with(self, path=None, text=""):
        """Returns the output of the script for the repository with one file replaced or added."""
        with tempfile.TemporaryDirectory() as folder:
            for name, content in {**FILES, **({path: text} if path else {})}.items():
                os.makedirs(os.path.dirname(os.path.join(folder, name)), exist_ok=True)
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(content)
            os.mkdir(os.path.join(folder, "scripts"))
            shutil.copy(os.path.join(ROOT, "scripts", "check-documents"), os.path.join(folder, "scripts"))
            subprocess.run(["git", "init", "-q", folder], check=True)
            subprocess.run(["git", "-C", folder, "add", "."], check=True)
            result = subprocess.run([os.path.join(folder, "scripts", "check-documents")], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1 if result.stdout else 0, result.stderr)
        return result.stdout

    def test_a_sound_repository_passes(self):
        self.assertEqual(self.output_with(), "")

    def test_every_planted_fault_is_reported(self):
        for path, text, line in FAULTS:
            with self.subTest(line):
                self.assertIn(line, self.output_with(path, text))


if __name__ == "__main__":
    unittest.main()
