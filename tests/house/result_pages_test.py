"""scripts/make-results on a small experiment, and the first screen of results/README.md: result_pages_test.py BUILD."""
import argparse
import csv
import importlib.machinery
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
BUILD = os.path.abspath(sys.argv.pop(1))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
HAS_MATPLOTLIB = importlib.util.find_spec("matplotlib") is not None
os.environ["LEGOPT"] = os.path.join(BUILD, "legopt")

from result_pages import sections, summary, tables  # noqa: E402  after the path


def make_results(folder, *options):
    return subprocess.run([sys.executable, "-B", os.path.join(ROOT, "scripts", "make-results"), folder, *options],
                          capture_output=True, text=True)


@unittest.skipUnless(HAS_MATPLOTLIB, "python3-matplotlib is missing")
class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = temporary.name
        cls.page = os.path.join(cls.folder, "page.md")
        cls.options = ["--parts", "--only", "parts-solid", "--narrow", "--problems 0-1 --tasks posture", "--out", cls.page]
        run = make_results(cls.folder, *cls.options)
        assert run.returncode == 0, run.stderr
        with open(cls.page, encoding="utf-8") as file:
            cls.text = file.read()

    def read(self, name):
        with open(os.path.join(self.folder, name), "rb") as file:
            return file.read()

    def test_files_that_it_names_exist(self):
        names = re.findall(r"\((figures/[^)]+|tables/[^)]+)\)", self.text)
        kinds = {name.split("parts-solid-")[1] for name in names}
        self.assertLessEqual({"success.svg", "effort.svg", "profile.svg", "targets.svg", "statistics.csv", "claims.csv"}, kinds)
        for name in names:
            self.assertGreater(len(self.read(name)), 100, name)

    def test_the_same_databases_make_the_same_bytes(self):
        files = [os.path.join(kind, name) for kind in ("figures", "tables") for name in
                 os.listdir(os.path.join(self.folder, kind))]
        before = {name: self.read(name) for name in [*files, "page.md"]}
        run = make_results(self.folder, *self.options, "--render")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual({name: self.read(name) for name in before}, before)

    def test_it_says_that_it_is_narrowed(self):
        self.assertIn("Narrowed: `--problems 0-1 --tasks posture`", self.text)

    def test_tables_have_every_row(self):
        rows = list(csv.DictReader(self.read("tables/parts-solid-statistics.csv").decode().splitlines()))
        self.assertEqual(len({tables.row_label(row | {"multi_starts": int(row["multi_starts"]), "sample_size": 100})
                              for row in rows}), 12)
        claims = list(csv.DictReader(self.read("tables/parts-solid-claims.csv").decode().splitlines()))
        self.assertEqual(list(claims[0]), tables.CLAIM_FIELDS)
        self.assertEqual({claim["a"] for claim in claims}, {"LegOpt-best"})

    def test_an_experiment_without_a_rule_counts_by_the_solid_rule(self):
        self.assertEqual(tables.rule_of(os.path.join(self.folder, "parts-solid.sqlite")), "solid")

    def test_a_page_of_nothing_is_refused(self):
        with tempfile.TemporaryDirectory() as empty:
            run = make_results(empty, *self.options, "--render")
            self.assertEqual(run.returncode, 1)
            self.assertIn("has no database", run.stderr)

    def test_a_page_without_times_has_none_in_its_tables(self):
        columns = next(csv.reader(self.read("tables/parts-solid-statistics.csv").decode().splitlines()))
        self.assertIn("work_median_ms", columns)
        self.assertEqual([column for column in columns if "time" in column or column in ("cpu_ms", "contended")], [])

    def test_a_part_of_a_page_does_not_replace_the_page(self):
        run = make_results(self.folder, "--parts", "--only", "parts-solid", "--render")
        self.assertEqual(run.returncode, 1)
        self.assertIn("--out", run.stderr)

    def test_all_pages_need_all_data(self):
        run = make_results(self.folder, "--all")
        self.assertEqual(run.returncode, 1)
        self.assertIn("needs --legopt", run.stderr)


@unittest.skipUnless(HAS_MATPLOTLIB, "python3-matplotlib is missing")
class AllPages(unittest.TestCase):
    """make_all with one small page in place of all."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.results = os.path.join(temporary.name, "results")
        self.options = argparse.Namespace(folder=os.path.join(temporary.name, "work"), legopt="unused", only="", narrow="",
                                          render=False, out=None)
        os.makedirs(self.options.folder)
        os.makedirs(self.results)
        self.write("README.md", "# Results\n\n" + summary.BEGIN + summary.END)
        self.write("page.md", "older")
        script = os.path.join(ROOT, "scripts", "make-results")
        loader = importlib.machinery.SourceFileLoader("make_results", script)
        self.script = importlib.util.module_from_spec(importlib.util.spec_from_loader("make_results", loader))
        loader.exec_module(self.script)
        for module, name, value in ((self.script, "RESULTS", self.results),
                                    (self.script, "refuse_other_sources", lambda: None),
                                    (summary, "HEADLINES", [summary.Solved("It solves them", "small", "LegOpt-best", "posture",
                                                                           "good")])):
            patch = mock.patch.object(module, name, value)
            patch.start()
            self.addCleanup(patch.stop)

    def write(self, name, text):
        with open(os.path.join(self.results, name), "w", encoding="utf-8") as file:
            file.write(text)

    def read(self, name):
        with open(os.path.join(self.results, name), encoding="utf-8") as file:
            return file.read()

    def make(self, suite, pages=("page.md",)):
        section = sections.Section("small", "Small", suite, ["--problems", "0-1", "--tasks", "posture", "--methods",
                                                             "LegOpt-best", "--collision", "solid"], "", ("effort",))
        failing = section._replace(name="failing", suite="no-such-suite")
        documents = {page: sections.Document(page, lambda page=page: [failing if page == "failing.md" else section], "# Page\n",
                                             False) for page in pages}
        with mock.patch.object(self.script, "DOCUMENTS", documents), mock.patch.object(summary, "DOCUMENTS", documents):
            self.script.make_all(self.options)

    def test_complete_pages_replace_the_older_ones(self):
        self.make("parts")
        self.assertIn("## Small", self.read("page.md"))
        self.assertIn("[It solves them](page.md)", self.read("README.md"))
        self.assertTrue(self.read("tables/small-statistics.csv"))

    def test_results_stay_as_they_are_if_a_later_page_fails(self):
        with self.assertRaises(SystemExit):
            self.make("parts", ("page.md", "failing.md"))
        self.assertEqual(self.read("page.md"), "older")
        self.assertEqual(sorted(os.listdir(self.results)), ["README.md", "page.md"])

    def test_results_stay_as_they_are_if_they_cannot_be_copied(self):
        with mock.patch.object(self.script.shutil, "copytree", side_effect=OSError("full")), self.assertRaises(OSError):
            self.make("parts")
        self.assertEqual(self.read("page.md"), "older")

    def test_pages_of_other_scripts_stay(self):
        self.write("performance.md", "other")
        self.make("parts")
        self.assertEqual(self.read("performance.md"), "other")

    def test_no_two_sections_share_a_database(self):
        names = [section.name for document in sections.DOCUMENTS.values() for section in document.sections()]
        self.assertEqual(len(names), len(set(names)))


class FirstScreen(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name
        os.makedirs(os.path.join(self.folder, "tables"))
        contents = {}
        for line in summary.HEADLINES:
            cell = {"task": line.task, "initialization": line.start}
            if isinstance(line, summary.Solved):
                method, *more = line.row.split(", ")
                restarts = more[0].split()[0] if more and "restarts" in more[0] else "0"
                surface = "surface" in more
                row = cell | {"method": method, "multi_starts": restarts, "sample_size": "100", "n": "35",
                              "collision": "surface" if surface else "solid",
                              "solved": "34.0", "share_lower": "0.855", "share_upper": "0.995"}
                contents.setdefault((line.section, line.table), []).append(row)
            else:
                row = cell | {"a": line.a, "b": line.b, "figure": line.figure, "pairs": "24", "value": "0.5", "lower": "0.25",
                              "upper": "0.75", "adjusted_p": "0.001", "reads": "better", "family": "42"}
                contents.setdefault((line.section, "claims"), []).append(row)
        for (section, kind), rows in contents.items():
            with open(os.path.join(self.folder, "tables", f"{section}-{kind}.csv"), "w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, list(rows[0]))
                writer.writeheader()
                writer.writerows({tuple(sorted(row.items())): row for row in rows}.values())
        for page, _ in summary.pages_of({line.section for line in summary.HEADLINES}).values():
            with open(os.path.join(self.folder, page), "w", encoding="utf-8") as file:
                file.write("# Page\n\nBuild 0123456789ab\n")

    def test_each_claim_has_figure_interval_n_and_command(self):
        text = summary.summary(self.folder)
        rows = [line for line in text.splitlines() if line.startswith("| [")]
        self.assertEqual(len(rows), len(summary.HEADLINES))
        self.assertIn("| 97.1 % solved | [85.5, 99.5] % | 35 | `legopt run legopt-best", rows[0])
        compared = next(row for row, line in zip(rows, summary.HEADLINES)
                        if isinstance(line, summary.Compared) and line.figure == "success")
        self.assertIn("50 percentage points: better | [25, 75] % | 24 |", compared)
        self.assertIn("; legopt compare SQP Adam --family 42 --db ten-seeds-hard.sqlite`", compared)
        self.assertIn("From build 0123456789ab.", text)

    def test_a_claim_without_a_row_is_refused(self):
        line = summary.HEADLINES[0]
        path = os.path.join(self.folder, "tables", f"{line.section}-{line.table}.csv")
        with open(path, encoding="utf-8") as file:
            head = file.readline()
        with open(path, "w", encoding="utf-8") as file:
            file.write(head)
        with self.assertRaisesRegex(LookupError, "0 rows"):
            summary.summary(self.folder)

    def test_only_the_block_is_replaced(self):
        text = "before\n" + summary.BEGIN + "old\n" + summary.END + "after\n"
        self.assertEqual(summary.replaced(text, "new\n"), text.replace("old", "new"))


if __name__ == "__main__":
    passed = unittest.main(exit=False).result.wasSuccessful()
    if passed and not HAS_MATPLOTLIB:
        print("SKIPPED, apart from FirstScreen: python3-matplotlib is missing")
        sys.exit(77)
    sys.exit(0 if passed else 1)
