"""A results database, opened read-only."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from . import pairs
from .errors import DatabaseError, RequestError, suggest
from .json_text import read_json
from .methods import read_methods
from .program import run_program
from .read_only_file import ReadOnlyFile
from .rows import Rows
from .trace import decode_history, decode_trace
from .waypoints import TIMED_TASKS, Waypoints, decode_waypoint

RULES = ["literal", "strict", "solid", "physical"]

_RULE = "SELECT rule FROM experiments WHERE :id IS NULL OR experiment_id = :id"

# One row per job: the view job_list, and further columns of the tables. solve_ms and contended follow
# docs/explanation/statistics.md, "What is counted".
_CONTENDED = "(r.involuntary_context_switches > 0 OR r.wall_us > 1.2 * r.cpu_us)"
_JOBS = f"""
SELECT l.*, e.name AS experiment, d.name AS dataset, e.seed, c.method_id, c.effort_limit,
  coalesce(c.wall_limit_us, e.wall_limit_us) AS wall_limit_us, w.build, {{results}},
  iif(r.cpu_us > 0, r.cpu_us, r.wall_us) / 1e3 AS solve_ms, {_CONTENDED} AS contended,
  CASE WHEN l.state = 'done' THEN coalesce(r.verdict_{{rule}} = 'success', 0)
    WHEN l.state IN ('failed', 'dead') THEN 0 END AS solved
FROM job_list AS l
JOIN jobs AS j USING (job_id)
JOIN cells AS c USING (cell_id)
JOIN experiments AS e ON e.experiment_id = c.experiment_id
JOIN datasets AS d USING (dataset_id)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id
WHERE :experiment IS NULL OR c.experiment_id = :experiment
ORDER BY l.job_id"""
_TRUTHS = ["incremental", "contended", "solved"]

# Columns of `results` that do not describe a result, or have a separate method here.
_LEFT_OUT = {"job_id", "cell_id", "attempt", "trace", "history_json"}

_NO_TRACE = "has a result without a trace: its solver took no step, or tells none"


class Database:
    """Every method reads the current content of the file, even while a server writes it. Use it in one thread; as a
    context manager it closes itself."""

    def __init__(self, path: str | os.PathLike[str], limit_s: float | None = 30):
        """`limit_s`: seconds after which a query is stopped (DatabaseError); None for no limit."""
        self._file = ReadOnlyFile(path, limit_s)

    def __enter__(self) -> Database:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"legopt.open({self.path!r})"

    @property
    def path(self) -> str:
        """Returns the path passed to the constructor."""
        return self._file.path

    def close(self) -> None:
        """Closes the file; afterwards every method raises DatabaseError."""
        self._file.close()

    def query(self, sql: str, parameters: Sequence[Any] | dict[str, Any] = ()) -> Rows:
        """Returns the rows of one SELECT, BLOBs as bytes; docs/reference/database.md lists tables and views.
        RequestError for wrong SQL."""
        return self._file.query(sql, parameters)

    def experiments(self) -> Rows:
        """Returns one row per experiment, from the view experiment_list; times are microseconds since 1970, UTC."""
        return self._file.select("SELECT * FROM experiment_list ORDER BY experiment_id")

    def methods(self, experiment: int | str | None = None) -> Rows:
        """Returns one row per method of an experiment (number or name; default: the newest). `choice` is its name in
        compare() and paired()."""
        return read_methods(self._file, self._experiment(experiment))

    def jobs(self, experiment: int | str | None = None, rule: str | None = None) -> Rows:
        """Returns one row per job of an experiment (number or name; default: all), with the columns of the view
        job_list and of the tables, and in addition

        * `choice`: the method's name in compare()
        * `rule`, `solved`: whether the judge accepts its solution by the rule (default: that of the experiment, or the
          weakest one for jobs of all experiments); None if the job never ran to its end
        * `contended`: whether other processes used its processor
        * `solve_ms`: CPU time of the whole solve

        RequestError for an unknown experiment or rule, or results without a verdict by the rule."""
        number = None if experiment is None else self._experiment(experiment)
        rule = self._rule(rule, number)
        self._require_verdicts(rule, number)
        jobs = self._file.select(_JOBS.format(rule=rule, results=self._result_columns()), {"experiment": number})
        choices: dict[tuple[int, int], str] = {}
        for known in {job["experiment_id"] for job in jobs}:
            for method in read_methods(self._file, known):
                choices[known, method["method_id"]] = method["choice"]
        for job in jobs:
            for name in _TRUTHS:
                job[name] = None if job[name] is None else bool(job[name])
            job["rule"] = rule
            job["choice"] = choices[job["experiment_id"], job["method_id"]]
        jobs.columns += ["rule", "choice"]
        return jobs

    def paired(self, a: int | str, b: int | str, experiment: int | str | None = None, *, method: str | None = None,
               task: str | None = None, initialization: str | None = None, rule: str | None = None) -> Rows:
        """Returns one row per problem requested of both, paired as by `legopt compare A B`: A and B are methods of
        an experiment (default: the newest), or experiments (number or name) whose methods of equal name and options are
        paired. Repetitions are averaged first. Columns:

        * `task`, `initialization`, `problem_id`; `choice_a`, `choice_b`: the methods
        * `job_a`, `job_b`: the first repetition of each
        * `finished_a`, `solved_a`, ...: repetitions that ran to their end, and that solved it
        * `solve_ms_a`, `cost_a`, ...: means over the solved ones; None if there are none
        * `outcome`: both, only_a, only_b, neither, or missing if one of them never ran to its end

        RequestError for an unknown method, experiment or rule, or for different datasets."""
        number = None if experiment is None else self._experiment(experiment)
        found = pairs.find_cells(self._file, str(a), str(b), number, method)
        sides = {found.experiment_a, found.experiment_b}
        rule = min((self._rule(rule, side) for side in sides), key=RULES.index)
        for side in sides:
            self._require_verdicts(rule, side)
        return pairs.read_pairs(self._file, found, task, initialization, rule)

    def waypoints(self, job: int) -> Waypoints:
        """Returns the solution of a job as far as it was solved, accepted by the judge or not; empty for a motion whose
        first window failed. RequestError if there is no such job, or it has no result."""
        facts = self._job(job, "d.joint_names, p.task FROM jobs AS j JOIN problems AS p USING (problem_key) "
                               "JOIN datasets AS d USING (dataset_id) LEFT JOIN results AS r ON r.job_id = j.job_id")
        stored = self._file.select("SELECT x FROM waypoints WHERE job_id = ? ORDER BY waypoint", [job])
        x = [decode_waypoint(row["x"], f"{self.path}: job {job}") for row in stored]
        times = [row.pop() for row in x] if facts["task"] in TIMED_TASKS else None
        names = self._joint_names(facts, job)
        if len({len(row) for row in x}) > 1 or x and names is not None and len(names) != len(x[0]) - 7:
            raise DatabaseError(f"{self.path}: job {job}: waypoints of different lengths, or not of its robot; "
                                "'legopt service doctor --db FILE' checks the database")
        return Waypoints(job, x, names, times)

    def unsolved_window(self, job: int) -> Waypoints | None:
        """Returns the best point of the window of a motion at which the solver ended, which is not part of the
        solution; `first_waypoint` is the number of its first row in the motion. None if all windows are solved, the
        window was not begun, or the result was made before schema version 11. RequestError if there is no such job, or
        it has no result."""
        facts = self._job(job, "d.joint_names FROM jobs AS j JOIN problems AS p USING (problem_key) "
                               "JOIN datasets AS d USING (dataset_id) LEFT JOIN results AS r ON r.job_id = j.job_id")
        stored = self._file.select("SELECT waypoint, x FROM unsolved_waypoints WHERE job_id = ? ORDER BY waypoint", [job])
        if not stored:
            return None
        x = [decode_waypoint(row["x"], f"{self.path}: job {job}") for row in stored]
        names = self._joint_names(facts, job)
        return Waypoints(job, x, names, first_waypoint=stored[0]["waypoint"])

    def trace(self, job: int) -> Rows:
        """Returns the convergence of a job's solve, one row per stored step, like `legopt show --trace`: step,
        window, restart, start, penalty, trust_box, accepted, evaluations, elapsed_us, cost, violation. For results before
        schema version 7: a row per penalty value with that version's columns. RequestError if there is no such job, or
        no trace."""
        facts = self._job(job, "r.trace, r.history_json FROM jobs AS j LEFT JOIN results AS r ON r.job_id = j.job_id")
        source = f"{self.path}: job {job}"
        if facts["trace"]:
            return decode_trace(facts["trace"], source)
        if facts["history_json"] is not None:
            return decode_history(facts["history_json"], source)
        raise RequestError(f"job {job} {_NO_TRACE}")

    def run(self, command: str, *arguments: object, program: str | os.PathLike[str] | None = None) -> str:
        """Returns the output of the program `legopt COMMAND ARGUMENTS --db FILE`: `db.run("table", 1, "--format",
        "csv")`. The program is `program`, else that of the environment variable LEGOPT, else the one on the PATH.
        ProgramError if there is none, or it refused."""
        return run_program([command, *map(str, arguments), "--db", os.path.abspath(self.path)], program)

    def compare(self, a: int | str, b: int | str, experiment: int | str | None = None, *, method: str | None = None,
                task: str | None = None, initialization: str | None = None, rule: str | None = None, margin: float = 0.0,
                charge_s: float | None = None, program: str | os.PathLike[str] | None = None) -> dict[str, Any]:
        """Returns the numbers of `legopt compare A B --format json`, computed by the program;
        docs/explanation/statistics.md defines each. A and B as for paired(); `margin`: percent by which times and costs must differ; `charge_s`:
        seconds charged for a failed run. Errors as for run()."""
        number = None if experiment is None else self._experiment(experiment)
        flags = _flags(experiment=number, method=method, task=task, initialization=initialization, rule=rule,
                       margin=margin, charge=charge_s)
        return read_json(self.run("compare", *flags, "--format", "json", str(a), str(b), program=program))

    def compare_with(self, other: Database | str | os.PathLike[str], experiment: int | None = None, *,
                     method: str | None = None, task: str | None = None, initialization: str | None = None,
                     rule: str | None = None, margin: float = 0.0, charge_s: float | None = None,
                     program: str | os.PathLike[str] | None = None) -> dict[str, Any]:
        """Compares two database files, this one as A: the newest experiment of each, or `experiment`."""
        path = other.path if isinstance(other, Database) else os.fspath(other)
        flags = _flags(experiment=experiment, method=method, task=task, initialization=initialization, rule=rule,
                       margin=margin, charge=charge_s)
        files = [os.path.abspath(self.path), os.path.abspath(path)]
        return read_json(run_program(["compare", *flags, "--format", "json", *files], program))

    # --- checks ----------------------------------------------------------------------------------------------------

    def _experiment(self, experiment: int | str | None) -> int:
        return pairs.find_experiment(self._file, experiment)

    def _job(self, job: int, columns: str) -> dict[str, Any]:
        found = self._file.select(f"SELECT j.state, r.job_id AS result, {columns} WHERE j.job_id = ?", [job])
        if not found:
            raise RequestError(f"job {job} does not exist; jobs() has those that do")
        if found[0]["result"] is None:
            raise RequestError(f"job {job} is {found[0]['state']} and has no result; "
                               f"'legopt show {job} --db {self.path}' shows what happened")
        return found[0]

    def _joint_names(self, facts: dict[str, Any], job: int) -> list[str] | None:
        if not facts["joint_names"]:
            return None
        try:
            names = read_json(facts["joint_names"])
            if isinstance(names, list) and all(isinstance(name, str) for name in names):
                return names
            raise ValueError("no list of names")
        except ValueError as error:
            raise DatabaseError(f"{self.path}: job {job}: the names of the joints cannot be read ({error}); "
                                "'legopt service doctor --db FILE' checks the database") from error

    def _result_columns(self) -> str:
        known = {row["name"] for row in self._file.select("SELECT name FROM pragma_table_xinfo('job_list')")}
        names = self._file.select("SELECT name FROM pragma_table_xinfo('results')").column("name")
        return ", ".join("r." + name for name in names
                         if name not in known | _LEFT_OUT and not name.startswith("solved_"))

    def _rule(self, rule: str | None, experiment: int | None) -> str:
        """Returns the requested rule, else the experiment's, as `legopt table` chooses it."""
        if rule is None:
            found = self._file.select(_RULE, {"id": experiment}).column("rule")
            return min(found, key=RULES.index, default="solid")
        if rule not in RULES:
            raise RequestError(f"'{rule}' is no rule; {suggest(rule, RULES)}")
        return rule

    def _require_verdicts(self, rule: str, experiment: int | None) -> None:
        if rule not in ("solid", "physical"):  # all results have the others
            return
        without = self._file.select(f"SELECT experiment_id FROM results JOIN cells USING (cell_id) WHERE "
                                    f"verdict_{rule} IS NULL AND (:id IS NULL OR experiment_id = :id) LIMIT 1",
                                    {"id": experiment})
        if without:
            raise RequestError(f"experiment {without[0]['experiment_id']} has results of a release without the {rule} "
                               "rule; judge their solutions again: 'legopt export', then 'legopt evaluate FILE --rule "
                               f"{rule}'")


def _flags(**given: object) -> list[str]:
    return [word for name, value in given.items() if value is not None for word in ("--" + name, str(value))]
