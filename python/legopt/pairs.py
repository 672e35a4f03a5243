"""Pairs two methods on the same problems, like client/compare in the program."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from .errors import RequestError, suggest
from .methods import Method, choose_method, find_method, read_methods
from .read_only_file import ReadOnlyFile
from .rows import Rows

COLUMNS = ["task", "initialization", "problem_id", "choice_a", "choice_b", "job_a", "job_b", "finished_a", "finished_b",
           "solved_a", "solved_b", "solve_ms_a", "solve_ms_b", "cost_a", "cost_b", "outcome"]
_SHORTEST_MS = 1e-3  # resolution of the clock: shorter times are raised to it
_US_PER_MS = 1e3


@dataclasses.dataclass(frozen=True)
class CellPairs:
    """The methods of the experiments that are paired."""

    experiment_a: int
    experiment_b: int
    methods: list[tuple[Method, Method]]


def find_experiment(file: ReadOnlyFile, experiment: int | str | None) -> int:
    """Returns the number of the experiment with this number or name, the newest of a name; None: the newest of all.
    RequestError if there is none."""
    known = file.select("SELECT experiment_id, name FROM experiments ORDER BY experiment_id DESC")
    if not known:
        raise RequestError("there is no experiment in the database yet")
    if experiment is None:
        return known[0]["experiment_id"]
    for row in known:
        if str(row["experiment_id"]) == str(experiment):
            return row["experiment_id"]
    for row in known:
        if row["name"] == experiment:
            return row["experiment_id"]
    raise RequestError(f"there is no experiment '{experiment}'; "
                       f"{suggest(experiment, [row['experiment_id'] for row in known])}")


def find_cells(file: ReadOnlyFile, a: str, b: str, experiment: int | None, method: str | None) -> CellPairs:
    """Finds the paired methods. A and B are methods of an experiment if A is one, else experiments."""
    common = find_experiment(file, experiment)
    ours = read_methods(file, common)
    mine = choose_method(a, ours, common) if experiment is not None else find_method(a, ours)
    if mine is not None:
        other = choose_method(b, ours, common)
        if mine["method_id"] == other["method_id"]:
            raise RequestError(f"A and B are the same, {mine['choice']} of experiment {common}; pairs take two")
        return CellPairs(common, common, [(mine, other)])
    return _pair_experiments(file, _experiment_or_method(file, a, ours, common),
                             _experiment_or_method(file, b, ours, common), method)


def _experiment_or_method(file: ReadOnlyFile, text: str, methods: Sequence[Method], newest: int) -> int:
    try:
        return find_experiment(file, text)
    except RequestError:
        raise RequestError(f"'{text}' is no experiment, and no method of experiment {newest}; "
                           f"{suggest(text, [method['choice'] for method in methods])}") from None


def _pair_experiments(file: ReadOnlyFile, a: int, b: int, method: str | None) -> CellPairs:
    if a == b:
        raise RequestError(f"A and B are the same, experiment {a}; pairs take two")
    datasets = file.select("SELECT DISTINCT dataset_id FROM experiments WHERE experiment_id IN (?, ?)", [a, b])
    if len(datasets) > 1:
        raise RequestError(f"experiments {a} and {b} ran on different datasets; their problems are not the same, so "
                           "that nothing can be paired")
    ours: Sequence[Method] = read_methods(file, a)
    theirs = read_methods(file, b)
    if method is not None:
        ours = [choose_method(method, ours, a)]
    if len(ours) == 1 and len(theirs) == 1:
        return CellPairs(a, b, [(ours[0], theirs[0])])
    paired = [(mine, other) for mine in ours if (other := _counterpart(mine, theirs)) is not None]
    if not paired:
        raise RequestError(f"experiment {b} has none of the methods of experiment {a}; "
                           f"{suggest(ours[0]['choice'], [other['choice'] for other in theirs])}")
    return CellPairs(a, b, paired)


def _counterpart(method: Method, others: Sequence[Method]) -> Method | None:
    """Returns the counterpart of `method`: one with equal options, else the first with equal name and options that
    distinguish it."""
    alike = [other for other in others
             if all(other[key] == method[key]
                    for key in ("method", "multi_starts", "sample_size", "incremental", "collision"))]
    equal = [other for other in alike if other["hash"] == method["hash"]]
    return (equal or alike or [None])[0]


def read_pairs(file: ReadOnlyFile, found: CellPairs, task: str | None, initialization: str | None, rule: str) -> Rows:
    """Returns the rows of Database.paired."""
    rows = Rows(COLUMNS)
    for mine, other in found.methods:
        cells_a = _cells(file, found.experiment_a, mine)
        cells_b = _cells(file, found.experiment_b, other)
        for word, place in ((task, 0), (initialization, 1)):
            known = sorted({kind[place] for kind in cells_a})
            if word is not None and word not in known:
                raise RequestError(f"{mine['choice']} has no jobs of '{word}'; {suggest(word, known)}")
        for kind in cells_a:
            if kind not in cells_b or task not in (None, kind[0]) or initialization not in (None, kind[1]):
                continue
            a, b = cells_a[kind], cells_b[kind]
            limit_us = min(a["wall_limit_us"], b["wall_limit_us"])
            theirs = _problems(file, b, rule, limit_us)
            for problem, ours in _problems(file, a, rule, limit_us).items():
                if problem in theirs:
                    rows.append(_row(kind, problem, (mine, ours), (other, theirs[problem])))
    if not rows:
        raise RequestError("A and B have no problem in common")
    return rows


def _cells(file: ReadOnlyFile, experiment: int, method: Method) -> dict[tuple[str, str], dict[str, Any]]:
    cells = file.select("SELECT c.cell_id, c.task, c.initialization, coalesce(c.wall_limit_us, e.wall_limit_us) AS "
                        "wall_limit_us FROM cells AS c JOIN experiments AS e USING (experiment_id) WHERE "
                        "c.experiment_id = ? AND c.method_id = ? ORDER BY c.cell_id", [experiment, method["method_id"]])
    return {(cell["task"], cell["initialization"]): cell for cell in cells}


@dataclasses.dataclass
class _Score:
    """One problem of one method, with its repetitions added up."""

    job: int
    finished: int = 0
    solved: int = 0
    solve_ms: float = 0.0  #: sums over the solved ones, in the program's order of addition
    cost: float = 0.0

    def mean(self, total: float) -> float | None:
        return total / self.solved if self.solved else None

    def mean_solve_ms(self) -> float | None:
        mean = self.mean(self.solve_ms)
        return None if mean is None else max(mean, _SHORTEST_MS)


def _problems(file: ReadOnlyFile, cell: dict[str, Any], rule: str, limit_us: int) -> dict[int, _Score]:
    jobs = file.select(
        "SELECT j.job_id, p.problem_id, j.state, r.cost, r.verdict_" + rule + " = 'success' AS solved, "
        "iif(r.cpu_us > 0, r.cpu_us, r.wall_us) AS solve_us "
        "FROM jobs AS j JOIN problems AS p USING (problem_key) LEFT JOIN results AS r ON r.job_id = j.job_id "
        "WHERE j.cell_id = ? ORDER BY p.problem_id, j.repetition", [cell["cell_id"]])
    problems: dict[int, _Score] = {}
    for job in jobs:
        score = problems.setdefault(job["problem_id"], _Score(job["job_id"]))
        if job["state"] not in ("done", "failed", "dead"):
            continue
        score.finished += 1
        # If limits differ, solves that took longer than the smaller one count as failed.
        in_time = limit_us >= cell["wall_limit_us"] or (job["solve_us"] or 0) <= limit_us
        if job["state"] == "done" and job["solved"] and in_time:
            score.solved += 1
            score.solve_ms += job["solve_us"] / _US_PER_MS
            score.cost += job["cost"]
    return problems


def _row(kind: tuple[str, str], problem: int, a: tuple[Method, _Score], b: tuple[Method, _Score]) -> dict[str, Any]:
    (method_a, ours), (method_b, theirs) = a, b
    values = [*kind, problem, method_a["choice"], method_b["choice"], ours.job, theirs.job, ours.finished,
              theirs.finished, ours.solved, theirs.solved, ours.mean_solve_ms(), theirs.mean_solve_ms(),
              ours.mean(ours.cost), theirs.mean(theirs.cost), _outcome(ours, theirs)]
    return dict(zip(COLUMNS, values, strict=True))


def _outcome(a: _Score, b: _Score) -> str:
    """Compares shares of solved repetitions, over a common denominator so that 1/3 equals 2/6."""
    if a.finished == 0 or b.finished == 0:
        return "missing"
    first, second = a.solved * b.finished, b.solved * a.finished
    if first != second:
        return "only_a" if first > second else "only_b"
    return "both" if first > 0 else "neither"
