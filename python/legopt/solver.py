"""Custom solvers in Python: docs/reference/external-solvers.md describes the protocol that this module implements.

    import legopt.solver

    def solve(problem):
        x = problem.start()
        ...
        return problem.solution(x, "converged")

    legopt.solver.serve(solve, name="mine", version="1")

Standard library only; all vectors are lists of floats. Print only to standard error: standard output is used by the
protocol. """

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TextIO

from .errors import LegoptError
from .json_text import read_json

__all__ = ["Contact", "Evaluation", "Problem", "Row", "Solution", "Stopped", "serve"]

PROTOCOL = 1


class ProtocolError(LegoptError):
    """A message of legopt that does not conform to this release of the protocol."""


class Stopped(Exception):
    """The time or effort limit of this solve is reached. `serve` handles it; a solver need not catch it."""


@dataclass(frozen=True)
class Row:
    """A constraint, v = 0 or v <= 0, or a preference: v <= 0 at the price of its weight."""

    kind: str  #: "equality", "inequality", "preference"
    first: int  #: index of the first variable that it depends on
    size: int  #: number of variables
    weight: float = 0.0  #: weight of a preference


@dataclass(frozen=True)
class Contact:
    """Two bodies that are near each other or penetrate each other. World frame, metres."""

    waypoint: int
    link: str  #: link of the robot
    other: str | None  #: another link; None: the scene
    distance: float  #: below 0: the length of the shortest translation that separates them
    point: list[float]  #: on the link
    other_point: list[float]  #: on the other
    normal: list[float]  #: unit vector from the other to the link

    @property
    def depth(self) -> float:
        """Returns the penetration depth; 0 if they are apart."""
        return max(0.0, -self.distance)


@dataclass(frozen=True)
class Evaluation:
    """The program's values at one point."""

    finite: bool  #: False: no other field is set; return to an earlier point
    cost: float = float("nan")
    violation: float = float("nan")  #: the largest of all rows
    values: list[float] = field(default_factory=list)  #: v of every row
    gradient: list[float] | None = None  #: gradient of the cost, one number per variable
    jacobian: list[list[float]] | None = None  #: Jacobian of every row with respect to its own variables (Row.first,
                                               #: Row.size)
    contacts: list[Contact] | None = None  #: contacts of all waypoints


@dataclass(frozen=True)
class Solution:
    """The result of a solver."""

    x: list[float]
    status: str  #: "converged", "limit", "failed"


class Problem:
    """minimise cost(x) subject to rows and lower <= x <= upper; x is relative to the start, which is all zeros."""

    def __init__(self, line: dict[str, Any], read: Callable[[], dict[str, Any]], write: Callable[[dict[str, Any]], None]):
        self._read, self._write = read, write
        self._asked = 0
        self._best: tuple[tuple[float, float], list[float]] | None = None
        self.num_variables: int = line["variables"]
        self.num_waypoints: int = line["waypoints"]
        self.lower = [float("-inf") if v is None else v for v in line["lower"]]
        self.upper = [float("inf") if v is None else v for v in line["upper"]]
        self.rows = [Row(r["kind"], r["first"], r["size"], r.get("weight", 0.0)) for r in line["rows"]]
        self.round: int = line["round"]  #: 0 at first, then one more for each improved start, with the rows that
                                         #: appeared
        self.seed: int = line["seed"]  #: seed of the solver's own random numbers
        self.tolerance: float = line["tolerance"]  #: larger violations are not accepted
        self.settings: dict[str, Any] = line["settings"]  #: settings of the description file

    def start(self) -> list[float]:
        """Returns the point where the solve begins."""
        return [0.0] * self.num_variables

    def evaluate(self, x: list[float], gradients: bool = False, contacts: bool = False) -> Evaluation:
        """Returns cost and rows at x; counted as effort. Raises Stopped."""
        self._asked += 1
        self._write({"type": "evaluate", "id": self._asked, "x": [float(v) for v in x], "gradients": gradients,
                     "contacts": contacts})
        answer = self._read()
        if answer["type"] == "cancel":
            raise Stopped
        if answer["type"] != "evaluation":
            raise ProtocolError(f"expected 'evaluation', got '{answer['type']}'")
        if not answer["finite"]:
            return Evaluation(False)
        found = [Contact(**{key: each[key] for key in Contact.__dataclass_fields__}) for each in answer["contacts"]] \
            if contacts else None
        evaluation = Evaluation(True, answer["cost"], answer["violation"], answer["values"], answer.get("gradient"),
                                answer.get("jacobian"), found)
        merit = (max(evaluation.violation - self.tolerance, 0.0), evaluation.cost)
        if self._best is None or merit < self._best[0]:
            self._best = (merit, [float(v) for v in x])
        return evaluation

    def progress(self, evaluation: Evaluation) -> None:
        """Adds a line to the solve's history (legopt show --trace)."""
        self._write({"type": "progress", "cost": evaluation.cost, "violation": evaluation.violation})

    def solution(self, x: list[float], status: str = "converged") -> Solution:
        """Returns the result of `solve`. `status`: converged, limit or failed."""
        return Solution([float(v) for v in x], status)

    def best(self, status: str = "limit") -> Solution:
        """Returns the best evaluated point: least violation above the tolerance, then least cost."""
        return Solution(self.start() if self._best is None else self._best[1], status)


def serve(solve: Callable[[Problem], Solution], name: str, version: str, source: TextIO | None = None,
          sink: TextIO | None = None) -> None:
    """Answers every problem by solve(problem) until legopt ends it. An exception of `solve` ends the process, and its
    last line of output is the reason that legopt reports; Stopped is answered by the best point so far."""
    source, sink = source or sys.stdin, sink or sys.stdout

    def read() -> dict[str, Any]:
        line = source.readline()
        if not line:
            raise SystemExit(0)  # legopt has ended
        return read_json(line)

    def write(message: dict[str, Any]) -> None:
        sink.write(json.dumps(message, allow_nan=False) + "\n")
        sink.flush()

    write({"type": "hello", "protocol": PROTOCOL, "name": name, "version": version})
    while True:
        line = read()
        if line["type"] == "cancel":
            continue  # message of a solve that had ended already
        if line["type"] != "solve" or line["protocol"] != PROTOCOL:
            raise ProtocolError(f"expected 'solve' of protocol {PROTOCOL}, got '{line['type']}'")
        problem = Problem(line, read, write)
        try:
            solution = solve(problem)
        except Stopped:
            solution = problem.best()
        write({"type": "solution", "x": solution.x, "status": solution.status})
