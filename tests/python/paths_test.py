"""Policy: paths, the solutions of continuous motions, keep their time stamps apart from their configurations, and pass
through files and commands like other solutions."""

import json
import unittest

import results

import legopt

PATHS = {"name": "paths", "tasks": ["continuous", "balanced"], "initializations": ["good"],
         "methods": [{"name": "LegOpt-best", "solver": "best"}]}


class PathsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = results.experiments()
        cls.file = cls.made.folder / "paths.sqlite"
        results.legopt("run", cls.made.suite(PATHS), "--dataset", cls.made.dataset, "--db", cls.file)
        cls.db = legopt.open(cls.file)
        cls.jobs = cls.db.jobs(1).where(solved=True)

    def test_both_tasks_are_solved(self):
        self.assertEqual({job["task"] for job in self.jobs}, {"continuous", "balanced"})

    def test_times_are_apart(self):
        for job in self.jobs:
            path = self.db.waypoints(job["job_id"])
            waypoints = [time for time in path.times if time == int(time)]
            self.assertEqual(waypoints, list(range(job["num_waypoints"])))
            self.assertEqual(path.times, sorted(set(path.times)))
            self.assertEqual(len(path.x), len(path.times))
            self.assertEqual({len(row) for row in path.joints}, {len(path.joint_names)})
            self.assertEqual(path.rows().columns[:2], ["time", path.joint_names[0]])
            self.assertEqual(path.rows()[1]["time"], path.times[1])
        self.assertTrue(any(len(self.db.waypoints(job["job_id"]).x) > job["num_waypoints"] for job in self.jobs))

    def test_a_motion_has_no_times(self):
        with legopt.open(self.made.backup) as db:
            self.assertIsNone(db.waypoints(db.jobs(1).where(task="motion")[0]["job_id"]).times)

    def test_files_carry_them_and_the_judge_agrees(self):
        results.legopt("export", 1, "--db", self.file, "--dataset", self.made.dataset, "--out",
                       self.made.folder / "paths.json")
        for task in ("continuous", "balanced"):
            file = self.made.folder / f"paths-{task}.json"
            self.assertEqual(json.loads(file.read_text())["task"], task)
            answer = json.loads(results.legopt("evaluate", file, "--dataset", self.made.dataset, "--format", "json"))
            (judged,) = answer["methods"]
            self.assertEqual(judged["solved"], sum(job["task"] == task for job in self.jobs))

    def test_a_file_whose_stamps_do_not_increase_is_told_so(self):
        results.legopt("export", 1, "--db", self.file, "--dataset", self.made.dataset, "--out",
                       self.made.folder / "bad.json")
        file = self.made.folder / "bad-continuous.json"
        content = json.loads(file.read_text())
        for problem in content["problems"]:
            for solution in problem["solution"]:
                solution["x"][1] = "\n".join([*solution["x"][1].split()[:-1], "0"])
        file.write_text(json.dumps(content))
        told = results.legopt("evaluate", file, "--dataset", self.made.dataset)
        self.assertIn("point 1 (time 0) is not later than the point before it, at 0", told)


if __name__ == "__main__":
    unittest.main()
