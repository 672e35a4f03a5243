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

RULES = ["literal", "strict", "solid"]

_RULE = "SELECT rule FROM experiments WHERE :id IS NULL OR experiment_id = :id"

# One row per job: the view job_list, and around it what the tables have besides. solve_ms and contended are the rule of
# docs/statistics.md, "What is counted".
_CONTENDED = "(r.involuntary_context_switches > 0 OR r.wall_us > 1.2 * r.cpu_us)"
_JOBS = f"""
SELECT l.*, e.name AS experiment, d.name AS dataset, e.seed, c.method_id, c.effort_limit,
  coalesce(c.wall_limit_us, e.wall_limit_us) AS wall_limit_us, w.build, {{results}},
  iif({_CONTENDED}, r.cpu_us, r.wall_us) / 1e3 AS solve_ms, {_CONTENDED} AS contended,
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

# Columns of `results` that say nothing about a result, or have a method of their own here.
_LEFT_OUT = {"job_id", "cell_id", "attempt", "trace", "history_json"}

_NO_TRACE = "has a result without a trace: its solver took no step, or tells none"


class Database:
    """Every method reads what the file has at that moment, also while a server works on it. Use it in one thread; as a
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
        """As it was given."""
        return self._file.path

    def close(self) -> None:
        """After that every method is a DatabaseError."""
        self._file.close()

    def query(self, sql: str, parameters: Sequence[Any] | dict[str, Any] = ()) -> Rows:
        """The rows of one SELECT, BLOBs as bytes; docs/database.md has tables and views. RequestError: wrong SQL."""
        return self._file.query(sql, parameters)

    def experiments(self) -> Rows:
        """One row per experiment, as the view experiment_list; times are microseconds since 1970, UTC."""
        return self._file.select("SELECT * FROM experiment_list ORDER BY experiment_id")

    def methods(self, experiment: int | str | None = None) -> Rows:
        """One row per method of an experiment (number or name; default: the newest), `choice` being the name by which
        compare() and paired() know it."""
        return read_methods(self._file, self._experiment(experiment))

    def jobs(self, experiment: int | str | None = None, rule: str | None = None) -> Rows:
        """One row per job of an experiment (number or name; default: of all), with the names of the view job_list and
        of the tables, and besides

        * `choice`: the method as compare() names it
        * `rule`, `solved`: whether the judge accepts its solution by the rule (default: that of the experiment, the
          weakest one where jobs of all are asked for); None: never run to its end
        * `contended`: whether others had its processor
        * `solve_ms`: time of the whole solve, its wall time, or its CPU time where contended

        RequestError: no such experiment or rule, or results without a verdict by it."""
        number = None if experiment is None else self._experiment(experiment)
        rule = self._rule(rule, number)
        if rule == "solid":
            self._require_solid_verdicts(number)
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
        """One row per problem that both were asked to solve, as `legopt compare A B` pairs them: A and B are methods of
        an experiment (default: the newest), or experiments (number or name) whose methods of equal name and figures are
        paired. Repetitions are averaged first. Columns:

        * `task`, `initialization`, `problem_id`; `choice_a`, `choice_b`: the methods
        * `job_a`, `job_b`: the first repetition of each
        * `finished_a`, `solved_a`, ...: repetitions that ran to their end, and that solved it
        * `solve_ms_a`, `cost_a`, ...: means over the solved ones; None where there is none
        * `outcome`: both, only_a, only_b, neither, or missing where one of them has never been run to its end

        RequestError: no such method, experiment, rule, or not one dataset."""
        number = None if experiment is None else self._experiment(experiment)
        found = pairs.find_cells(self._file, str(a), str(b), number, method)
        sides = {found.experiment_a, found.experiment_b}
        rule = min((self._rule(rule, side) for side in sides), key=RULES.index)
        for side in sides:
            if rule == "solid":
                self._require_solid_verdicts(side)
        return pairs.read_pairs(self._file, found, task, initialization, rule)

    def waypoints(self, job: int) -> Waypoints:
        """The solution of a job as far as it came, whether the judge accepts it or not; of a motion that lost its first
        window that is nothing. RequestError: no such job, or it has no result."""
        facts = self._job(job, "d.joint_names, p.task FROM jobs AS j JOIN problems AS p USING (problem_key) "
                               "JOIN datasets AS d USING (dataset_id) LEFT JOIN results AS r ON r.job_id = j.job_id")
        stored = self._file.select("SELECT x FROM waypoints WHERE job_id = ? ORDER BY waypoint", [job])
        x = [decode_waypoint(row["x"], f"{self.path}: job {job}") for row in stored]
        times = [row.pop() for row in x] if facts["task"] in TIMED_TASKS else None
        names = self._joint_names(facts, job)
        if len({len(row) for row in x}) > 1 or x and names is not None and len(names) != len(x[0]) - 7:
            raise DatabaseError(f"{self.path}: job {job}: waypoints of different lengths, or not of its robot; "
                                "'legopt doctor --db FILE' checks the database")
        return Waypoints(job, x, names, times)

    def unsolved_window(self, job: int) -> Waypoints | None:
        """The best point of the window of a motion at which the solver ended, no part of the solution; `first_waypoint` is
        the number of its first row in the motion. None: all windows are solved, the window was not begun, or the result
        was made before schema version 11. RequestError: no such job, or it has no result."""
        facts = self._job(job, "d.joint_names FROM jobs AS j JOIN problems AS p USING (problem_key) "
                               "JOIN datasets AS d USING (dataset_id) LEFT JOIN results AS r ON r.job_id = j.job_id")
        stored = self._file.select("SELECT waypoint, x FROM unsolved_waypoints WHERE job_id = ? ORDER BY waypoint", [job])
        if not stored:
            return None
        x = [decode_waypoint(row["x"], f"{self.path}: job {job}") for row in stored]
        names = self._joint_names(facts, job)
        return Waypoints(job, x, names, first_waypoint=stored[0]["waypoint"])

    def trace(self, job: int) -> Rows:
        """How its solve converged, one row per step that is kept, as `legopt trace`: step, window, restart, start,
        penalty, trust_box, accepted, evaluations, elapsed_us, cost, violation. Of results before schema version 7 a row
        per penalty value, in the columns of then. RequestError: no such job, or no trace."""
        facts = self._job(job, "r.trace, r.history_json FROM jobs AS j LEFT JOIN results AS r ON r.job_id = j.job_id")
        source = f"{self.path}: job {job}"
        if facts["trace"]:
            return decode_trace(facts["trace"], source)
        if facts["history_json"] is not None:
            return decode_history(facts["history_json"], source)
        raise RequestError(f"job {job} {_NO_TRACE}")

    def run(self, command: str, *arguments: object, program: str | os.PathLike[str] | None = None) -> str:
        """What the program `legopt COMMAND ARGUMENTS --db FILE` prints: `db.run("table", 1, "--format", "csv")`. The
        program is `program`, else what the environment variable LEGOPT names, else on the PATH. ProgramError: there is
        none, or it refused."""
        return run_program([command, *map(str, arguments), "--db", os.path.abspath(self.path)], program)

    def compare(self, a: int | str, b: int | str, experiment: int | str | None = None, *, method: str | None = None,
                task: str | None = None, initialization: str | None = None, rule: str | None = None, margin: float = 0.0,
                charge_s: float | None = None, program: str | os.PathLike[str] | None = None) -> dict[str, Any]:
        """What `legopt compare A B --format json` says, number for number, because it is asked; docs/statistics.md
        defines each. A and B as for paired(); `margin`: percent by which times and costs must differ; `charge_s`:
        seconds that a failed run costs. Errors as of run()."""
        number = None if experiment is None else self._experiment(experiment)
        flags = _flags(experiment=number, method=method, task=task, initialization=initialization, rule=rule,
                       margin=margin, charge=charge_s)
        return read_json(self.run("compare", *flags, "--format", "json", str(a), str(b), program=program))

    def compare_with(self, other: Database | str | os.PathLike[str], experiment: int | None = None, *,
                     method: str | None = None, task: str | None = None, initialization: str | None = None,
                     rule: str | None = None, margin: float = 0.0, charge_s: float | None = None,
                     program: str | os.PathLike[str] | None = None) -> dict[str, Any]:
        """The same of two database files, this one being A: of the newest experiment of each, or of `experiment`."""
        path = other.path if isinstance(other, Database) else os.fspath(other)
        flags = _flags(experiment=experiment, method=method, task=task, initialization=initialization, rule=rule,
                       margin=margin, charge=charge_s)
        files = [os.path.abspath(self.path), os.path.abspath(path)]
        return read_json(run_program(["compare", *flags, "--format", "json", *files], program))

    # --- below: checks -----------------------------------------------------------------------------------------------

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
                                "'legopt doctor --db FILE' checks the database") from error

    def _result_columns(self) -> str:
        known = {row["name"] for row in self._file.select("SELECT name FROM pragma_table_xinfo('job_list')")}
        names = self._file.select("SELECT name FROM pragma_table_xinfo('results')").column("name")
        return ", ".join("r." + name for name in names
                         if name not in known | _LEFT_OUT and not name.startswith("solved_"))

    def _rule(self, rule: str | None, experiment: int | None) -> str:
        """The rule asked for, else the experiment's, as `legopt table` chooses it."""
        if rule is None:
            found = self._file.select(_RULE, {"id": experiment}).column("rule")
            return min(found, key=RULES.index, default="solid")
        if rule not in RULES:
            raise RequestError(f"'{rule}' is no rule; {suggest(rule, RULES)}")
        return rule

    def _require_solid_verdicts(self, experiment: int | None) -> None:
        without = self._file.select("SELECT experiment_id FROM results JOIN cells USING (cell_id) WHERE "
                                    "verdict_solid IS NULL AND (:id IS NULL OR experiment_id = :id) LIMIT 1",
                                    {"id": experiment})
        if without:
            raise RequestError(f"experiment {without[0]['experiment_id']} has results of a release without the solid "
                               "rule; judge their solutions again: 'legopt export', then 'legopt evaluate FILE --rule "
                               "solid'")


def _flags(**given: object) -> list[str]:
    return [word for name, value in given.items() if value is not None for word in ("--" + name, str(value))]
