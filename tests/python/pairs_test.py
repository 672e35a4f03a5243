"""Pairs and comparisons have the numbers of the program."""

import json
import os
import unittest
from pathlib import Path
from unittest import mock

import results

import legopt


class PairsAreThoseOfTheProgram(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = results.experiments()
        cls.db = legopt.open(cls.made.backup)
        cls.addClassCleanup(cls.db.close)

    def check(self, a, b, *flags, **chosen):
        """Checks the counts, and the ratios of the listed problems, against `legopt compare`."""
        said = self.made.listing("compare", a, b, *flags)
        pairs = self.db.paired(a, b, **chosen)
        self.assertIn(len(said["comparisons"]), range(1, 5))  # for one pair of methods
        for cell in said["comparisons"]:
            of_cell = pairs.where(task=cell["task"], initialization=cell["initialization"])
            counted = {outcome: sum(pair["outcome"] == outcome for pair in of_cell)
                       for outcome in ("both", "only_a", "only_b", "neither", "missing")}
            self.assertEqual(counted, {outcome: cell[outcome] for outcome in counted})
            by_problem = {pair["problem_id"]: pair for pair in of_cell}
            for told in cell["fastest"] + cell["slowest"]:
                pair = by_problem[told["problem"]]
                self.assertEqual((pair["job_a"], pair["job_b"]), (told["job_a"], told["job_b"]))
                self.assertEqual(pair["solve_ms_b"] / pair["solve_ms_a"], told["time_ratio"])
        return pairs

    def test_methods(self):
        pairs = self.check("LegOpt-best", "SQP:multi_starts=0", "--experiment", 1, experiment=1)
        self.assertEqual(len(pairs), 18)
        self.assertEqual(set(pairs.column("finished_a")), {2})
        for pair in pairs:
            for side in "ab":
                self.assertEqual(pair["cost_" + side] is None, pair["solved_" + side] == 0)
                self.assertEqual(pair["solve_ms_" + side] is None, pair["solved_" + side] == 0)

    def test_rules_tasks_and_starts(self):
        for rule in ("strict", "solid"):
            self.check("SQP:multi_starts=0", "SQP:multi_starts=10", "--experiment", 1, "--rule", rule, experiment=1, rule=rule)
        pairs = self.check("SQP:multi_starts=0", "SQP:multi_starts=10", "--experiment", 1, "--task", "motion",
                           "--initialization", "good", experiment=1, task="motion", initialization="good")
        self.assertEqual({(pair["task"], pair["initialization"]) for pair in pairs}, {("motion", "good")})

    def test_experiments(self):
        pairs = self.check(1, 2)
        self.assertEqual(set(pairs.column("problem_id")), {0, 3, 4, 5})
        self.assertEqual({(pair["choice_a"], pair["finished_a"], pair["finished_b"]) for pair in pairs},
                         {("SQP:multi_starts=10", 2, 1)})
        self.assertEqual(self.check("first", "second"), pairs)
        self.check(2, 1, "--method", "SQP:multi_starts=10", method="SQP:multi_starts=10")

    def test_methods_of_the_newest_experiment(self):
        pairs = self.check("SQP:multi_starts=0", "SQP:multi_starts=10")
        self.assertEqual(len(pairs), 4)

    def test_costs_are_means_of_the_solved_jobs(self):
        jobs = self.db.jobs(1)
        for pair in self.db.paired("SQP:multi_starts=0", "LegOpt-best", 1):
            solved = jobs.where(choice="LegOpt-best", task=pair["task"], initialization=pair["initialization"],
                                problem_id=pair["problem_id"], solved=True)
            self.assertEqual(len(solved), pair["solved_b"])
            if solved:
                self.assertAlmostEqual(pair["cost_b"], sum(solved.column("cost")) / len(solved))
                self.assertAlmostEqual(pair["solve_ms_b"], sum(solved.column("solve_ms")) / len(solved))

    def test_wrong_requests(self):
        best = "LegOpt-best"
        wrong = [(("SQP", best, 1), {}, "'SQP' names 2 methods; say which: 'SQP:multi_starts=0', 'SQP:multi_starts=10'"),
                 (("SGD", best, 1), {}, "experiment 1 has no method 'SGD'; .*LegOpt-best"),
                 ((best, "SGD", 1), {}, "experiment 1 has no method 'SGD'"),
                 ((best, best, 1), {}, "are the same, LegOpt-best of experiment 1"),
                 (("SQP:multi_starts=3", best, 1), {}, "no 'SQP' is like 'SQP:multi_starts=3'; there is"),
                 (("SQP:starts=3", best, 1), {}, "'starts' tells no methods apart; did you mean 'multi_starts'"),
                 (("SQP:3", best, 1), {}, "'3' is no figure of a method; write it as NAME:multi_starts=10"),
                 ((best, "SQP:id=1", 1), {"task": "postures"}, "no jobs of 'postures'; did you mean 'posture'"),
                 ((best, "SQP:id=1", 1), {"rule": "x"}, "'x' is no rule"),
                 ((best, "SQP:id=1", 5), {}, "no experiment '5'"),
                 (("nobody", best), {}, "'nobody' is no experiment, and no method of experiment 2"),
                 ((2, 2), {}, "are the same, experiment 2"),
                 ((1, 2), {"method": best}, "experiment 2 has none of the methods of experiment 1")]
        for arguments, chosen, text in wrong:
            with self.assertRaisesRegex(legopt.RequestError, text):
                self.db.paired(*arguments, **chosen)
        self.assertEqual(self.db.paired("legopt-BEST", "sqp:multi_starts=0", 1)[0]["choice_a"], best)


class ComparisonsAreThoseOfTheProgram(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = results.experiments()
        cls.db = legopt.open(cls.made.backup)
        cls.addClassCleanup(cls.db.close)

    def test_every_number(self):
        for arguments, chosen, flags in (
                (("SQP:multi_starts=0", "SQP:multi_starts=10", 1), {}, ["--experiment", 1]),
                (("LegOpt-best", "SQP:multi_starts=10", "first"),
                 {"task": "posture", "initialization": "good", "rule": "strict", "margin": 5, "charge_s": 2.5},
                 ["--experiment", 1, "--task", "posture", "--initialization", "good", "--rule", "strict", "--margin", 5,
                  "--charge", 2.5]),
                ((1, 2), {"method": "SQP:multi_starts=10"}, ["--method", "SQP:multi_starts=10"])):
            self.assertEqual(self.db.compare(*arguments, **chosen), self.made.listing("compare", *arguments[:2], *flags))

    def test_two_files(self):
        other = self.made.copy()
        expected = json.loads(results.legopt("compare", self.made.backup, other, "--experiment", 1, "--method", "LegOpt-best",
                                             "--format", "json"))
        with legopt.open(other) as second:
            for given in (second, other, str(other)):
                self.assertEqual(self.db.compare_with(given, 1, method="LegOpt-best"), expected)

    def test_a_file_of_the_name_of_a_method_is_not_taken_for_it(self):
        here = Path.cwd()
        self.addCleanup(os.chdir, here)
        folder = self.made.copy("LegOpt-best").parent
        os.chdir(folder)
        with legopt.open("LegOpt-best") as db:
            self.assertEqual(db.compare("LegOpt-best", "SQP:multi_starts=10", 1)["a"]["experiment_id"], 1)

    def test_what_the_program_refuses_is_told(self):
        with self.assertRaisesRegex(legopt.ProgramError, "experiment 1 has no method 'SGD'") as caught:
            self.db.compare("LegOpt-best", "SGD", 1)
        self.assertEqual(caught.exception.exit_code, 2)

    def test_the_program_is_found(self):
        program = os.environ["LEGOPT"]
        arguments = ("table", 1, "--format", "csv")
        expected = self.db.run(*arguments, program=program)
        with mock.patch.dict(os.environ, {"PATH": os.path.dirname(program)}):
            del os.environ["LEGOPT"]
            self.assertEqual(self.db.run(*arguments), expected)
            os.environ["PATH"] = "/nowhere"
            with self.assertRaisesRegex(legopt.ProgramError, "not on the PATH; install legopt, or name it"):
                self.db.run(*arguments)
            with self.assertRaisesRegex(legopt.ProgramError, "'/no/legopt' is no program") as caught:
                self.db.run(*arguments, program="/no/legopt")
            self.assertIsNone(caught.exception.exit_code)
            self.assertEqual(self.db.run(*arguments, program=os.path.relpath(program)), expected)
            broken = self.made.folder / "broken"
            broken.write_text("no program")
            broken.chmod(0o755)
            with self.assertRaisesRegex(legopt.ProgramError, "cannot be run"):
                self.db.run(*arguments, program=broken)
