"""A database has the same content in Python as in the program, cell by cell."""

import csv
import io
import itertools
import json
import sqlite3
import statistics
import unittest

import results

import legopt


class EqualToTheProgram(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = results.experiments()
        cls.db = legopt.open(cls.made.backup)
        cls.addClassCleanup(cls.db.close)

    def test_experiments(self):
        self.assertEqual(self.db.experiments(), self.made.query("SELECT * FROM experiment_list ORDER BY experiment_id"))

    def test_jobs_are_the_rows_of_the_view(self):
        listed = self.made.query("SELECT * FROM job_list ORDER BY job_id")
        jobs = self.db.jobs()
        self.assertEqual([{name: job[name] for name in listed[0]} for job in jobs], listed)
        self.assertEqual({job["experiment_id"] for job in jobs}, {1, 2})
        self.assertTrue(all(list(job) == jobs.columns for job in jobs))
        self.assertTrue(any(job["taken_from"] for job in jobs))

    def test_jobs_are_those_of_the_listing(self):
        listed = self.made.listing("list", 1, "--limit", 1000)
        jobs = self.db.jobs(1)
        names = {"job": "job_id", "problem": "problem_id", "verdict": "verdict_literal"}
        self.assertEqual([{shown: job[names.get(shown, shown)] for shown in listed[0]} for job in jobs], listed)

    def test_columns_of_the_tables_stand_beside_the_view(self):
        for job in self.db.jobs(1)[::7]:
            shown = json.loads(results.legopt("show", job["job_id"], "--db", self.made.backup, "--format", "json"))
            result = {name: value for name, value in shown["result"].items() if name not in ("attempt", "trace_bytes")}
            self.assertEqual({name: job[name] for name in result}, result)
            for name in ("experiment", "dataset", "seed", "effort_limit"):
                self.assertEqual(job[name], shown[name])
            self.assertEqual(job["wall_limit_us"], shown["wall_limit_s"] * 1e6)

    def test_the_table_follows_from_the_jobs_by_each_rule(self):
        for rule in ("literal", "strict", "solid"):
            table = list(csv.DictReader(io.StringIO(
                results.legopt("table", 1, "--rule", rule, "--db", self.made.backup, "--format", "csv"))))
            self.assertEqual(len(table), 3)
            for row in table:
                for task, start in itertools.product(("posture", "motion"), ("good", "in_collision")):
                    jobs = self.db.jobs(1, rule=rule).where(method=row["method"], multi_starts=int(row["multi_starts"]),
                                                            task=task, initialization=start)
                    self.compare_cell(jobs, {name: row[f"{task}_{start}_{name}"]
                                             for name in ("n", "solved", "cost", "time_s")})
                    self.assertEqual({job["rule"] for job in jobs}, {rule})

    def compare_cell(self, jobs, cell):
        solved = jobs.where(solved=True)
        self.assertEqual((len(jobs), len(solved)), (int(cell["n"]), int(cell["solved"])))
        self.assertEqual(cell["cost"] == "", not solved)
        for name in ("cost", "time_s") if solved else ():
            mean = statistics.fmean(solved.column(name))
            self.assertAlmostEqual(mean, float(cell[name]), delta=1e-12 * mean)

    def test_traces(self):
        traced = [job["job_id"] for job in self.made.query(
            "SELECT job_id FROM results WHERE trace IS NOT NULL ORDER BY length(trace) DESC, job_id")]
        for job in traced[:3] + traced[-3:]:
            self.assertEqual(self.db.trace(job), self.made.listing("show", job, "--trace"))
            text = results.legopt("show", job, "--trace", "--db", self.made.backup, "--format", "csv")
            self.assertEqual(",".join(self.db.trace(job).columns), text.splitlines()[0])

    def test_a_query_is_that_of_the_program(self):
        for sql in ("SELECT * FROM benchmark_table", "SELECT 1 AS a, 2 AS a, 'x' AS b",
                    "SELECT key FROM json_each('[5, 6]')", "SELECT name FROM pragma_table_info('jobs')"):
            self.assertEqual(self.db.query(sql), self.made.query(sql))
        self.assertEqual(self.db.query("SELECT state FROM jobs WHERE job_id = :job", {"job": 1}), [{"state": "done"}])

    def test_waypoints_are_those_of_the_export(self):
        results.legopt("export", 1, "--db", self.made.backup, "--dataset", self.made.dataset, "--out",
                       self.made.folder / "solutions.json")
        exported = []
        for task in ("posture", "motion"):
            for problem in json.loads((self.made.folder / f"solutions-{task}.json").read_text())["problems"]:
                exported += [(task, problem["id"], [[float(number) for number in x.split()] for x in solution["x"]])
                             for solution in problem["solution"]]
        jobs = self.db.jobs(1)
        ours = [(job["task"], job["problem_id"], self.db.waypoints(job["job_id"]).x) for job in jobs]
        self.assertTrue(any(x == [] for _, _, x in ours))  # a motion whose first window failed
        self.assertEqual(sorted(ours), sorted(exported))

    def test_waypoints_have_names_and_parts(self):
        solution = self.db.waypoints(self.db.jobs(1).where(task="motion")[0]["job_id"])
        (names,) = self.made.query("SELECT joint_names FROM datasets")
        self.assertEqual(solution.joint_names, json.loads(names["joint_names"]))
        self.assertGreater(len(solution), 1)
        for row, joints, position, quaternion in zip(solution.x, solution.joints, solution.base_position,
                                                     solution.base_quaternion):
            self.assertEqual(joints + position + quaternion, row)
            self.assertAlmostEqual(sum(value * value for value in quaternion), 1.0, places=9)
        self.assertEqual(list(solution.rows()[1])[:2], ["waypoint", solution.joint_names[0]])
        self.assertEqual(solution.rows()[1]["base_qw"], solution.x[1][-4])

    def test_methods_have_the_names_that_compare_takes(self):
        choices = self.db.methods(1).column("choice")
        self.assertEqual(choices, ["SQP:multi_starts=0", "SQP:multi_starts=10", "LegOpt-best"])
        self.assertEqual(self.db.methods("second").column("choice"), ["SQP:multi_starts=10", "SQP:multi_starts=0"])
        self.assertEqual(set(self.db.jobs(1).column("choice")), set(choices))


class OlderAndOtherResults(unittest.TestCase):
    """Rows that current programs never write: the database is changed with its triggers removed, which are then
    restored."""

    def changed(self, *statements):
        path = results.experiments().copy()
        db = sqlite3.connect(path)
        guards = db.execute("SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'").fetchall()
        for name, _ in guards:
            db.execute(f"DROP TRIGGER {name}")
        for statement in statements:
            db.execute(statement)
        for _, sql in guards:
            db.execute(sql)
        db.execute("PRAGMA journal_mode = DELETE")
        db.commit()
        db.close()
        return path

    def test_a_history_stands_for_a_trace(self):
        history = {"columns": ["penalty", "cost"], "rows": [[100.0, 2.5], [1000.0, None]]}
        path = self.changed(f"UPDATE results SET trace = NULL, history_json = '{json.dumps(history)}' WHERE job_id = 1",
                            "UPDATE results SET trace = NULL WHERE job_id = 2")
        with legopt.open(path) as db:
            self.assertEqual(db.trace(1), results.experiments().listing("show", 1, "--trace", db=path))
            with self.assertRaisesRegex(legopt.RequestError, "job 2 has a result without a trace"):
                db.trace(2)

    def test_the_unsolved_window_of_a_motion_is_apart(self):
        with legopt.open(self.changed()) as db:
            self.assertIsNone(db.unsolved_window(1))
        path = self.changed(
            "UPDATE results SET verdict_literal = 'window_unsolved', verdict_strict = 'window_unsolved', verdict_solid = "
            "'window_unsolved', verdict_physical = 'window_unsolved', cost = NULL, window_verdict = 'foot_pose' WHERE job_id = 1",
            "INSERT INTO unsolved_waypoints SELECT 1, 10, x FROM waypoints WHERE job_id = 1 AND waypoint = 0")
        with legopt.open(path) as db:
            window = db.unsolved_window(1)
            self.assertEqual(window.x, db.waypoints(1).x[:1])
            self.assertEqual(window.rows()[0]["waypoint"], 10)

    def test_damaged_traces_and_waypoints_are_named(self):
        path = self.changed(
            "UPDATE results SET trace = CAST(substr(trace, 1, 3) AS BLOB) WHERE job_id = 1",
            "UPDATE results SET trace = substr(trace, 1, 20) WHERE job_id = 2",
            "UPDATE results SET trace = substr(trace, 1, length(trace) - 1) WHERE job_id = 3",
            "UPDATE results SET trace = CAST(substr(trace, 1, 30) || x'00' || substr(trace, 32) AS BLOB) WHERE job_id = 4",
            "UPDATE waypoints SET x = substr(x, 1, 8) WHERE job_id = 5",
            "DELETE FROM waypoints WHERE job_id = 6",
            "UPDATE waypoints SET x = substr(x, 1, 80) WHERE job_id = 7")
        with legopt.open(path) as db:
            for job in (1, 2, 3):
                with self.assertRaisesRegex(legopt.DatabaseError, f"job {job}: the trace .* is damaged"):
                    db.trace(job)
            try:  # one bit in a compressed part changes the content or makes it unreadable, without a crash
                db.trace(4)
            except legopt.DatabaseError:
                pass
            for job in (5, 7):
                with self.assertRaisesRegex(legopt.DatabaseError, f"job {job}.*'legopt service doctor"):
                    db.waypoints(job)
            nothing = db.waypoints(6)
            self.assertEqual((len(nothing), nothing.joints, len(nothing.names)), (0, [], 19))

    def test_the_solid_rule_needs_its_verdicts(self):
        path = self.changed("UPDATE results SET verdict_solid = NULL WHERE job_id = 1",
                            "UPDATE experiments SET rule = 'literal' WHERE experiment_id = 1")
        with legopt.open(path) as db:
            self.assertTrue(db.jobs(1, rule="strict"))
            self.assertEqual({job["rule"] for job in db.jobs()}, {"literal"}, "the weakest of both experiments")
            self.assertEqual({job["rule"] for job in db.jobs(2)}, {"solid"})
            self.assertTrue(db.jobs(2, rule="solid"))
            for ask in (lambda: db.jobs(1, rule="solid"), lambda: db.jobs(rule="solid"),
                        lambda: db.paired("LegOpt-best", "SQP:multi_starts=0", 1, rule="solid")):
                with self.assertRaisesRegex(legopt.RequestError, "experiment 1 has results .* without the solid rule"):
                    ask()

    def test_texts_of_the_file_that_are_not_json_are_named(self):
        doubled = '{"columns": ["cost"], "rows": [[1.5]], "rows": []}'
        path = self.changed("UPDATE datasets SET joint_names = '[\"a\", 1, \"b\"]'",
                            f"UPDATE results SET trace = NULL, history_json = '{doubled}' WHERE job_id = 1")
        with legopt.open(path) as db:
            for ask in (db.waypoints, db.trace):
                with self.assertRaisesRegex(legopt.DatabaseError, "job 1: .*cannot be read .*'legopt service doctor"):
                    ask(1)

    def test_joints_without_names_are_numbered(self):
        path = self.changed("UPDATE datasets SET joint_names = NULL")
        with legopt.open(path) as db:
            solution = db.waypoints(1)
            self.assertIsNone(solution.joint_names)
            self.assertEqual(solution.names[:2] + solution.names[-1:], ["joint_0", "joint_1", "base_qz"])
