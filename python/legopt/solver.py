"""A solver of one's own in Python: docs/solvers.md has the protocol that this speaks.

    import legopt.solver

    def solve(problem):
        x = problem.start()
        ...
        return problem.solution(x, "converged")

    legopt.solver.serve(solve, name="mine", version="1")

Standard library only; all vectors are lists of floats. Print to standard error only: standard output is the protocol's.
"""

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
    """What legopt sent is not what this release of the protocol has."""


class Stopped(Exception):
    """legopt has no more time or effort for this solve. `serve` answers it; a solver need not catch it."""


@dataclass(frozen=True)
class Row:
    """A constraint, or a wish: v = 0, v <= 0, or as near to v <= 0 as its weight is worth."""

    kind: str  #: "equality", "inequality", "preference"
    first: int  #: the first variable that it depends on
    size: int  #: so many, from there on
    weight: float = 0.0  #: of a preference


@dataclass(frozen=True)
class Contact:
    """Two bodies that are near each other, or go through each other. World frame, metres."""

    waypoint: int
    link: str  #: of the robot
    other: str | None  #: a link, too; None: the scene
    distance: float  #: below 0: the length of the way that parts them
    point: list[float]  #: on the link
    other_point: list[float]  #: on the other
    normal: list[float]  #: unit vector from the other to the link

    @property
    def depth(self) -> float:
        """How far one is in the other; 0 where they are apart."""
        return max(0.0, -self.distance)


@dataclass(frozen=True)
class Evaluation:
    """The program at one point."""

    finite: bool  #: otherwise there is nothing else: go back
    cost: float = float("nan")
    violation: float = float("nan")  #: the largest of a row
    values: list[float] = field(default_factory=list)  #: v of every row
    gradient: list[float] | None = None  #: of the cost, one number a variable
    jacobian: list[list[float]] | None = None  #: of every row, by its own variables (Row.first, Row.size)
    contacts: list[Contact] | None = None  #: of every waypoint


@dataclass(frozen=True)
class Solution:
    """A solver's last word."""

    x: list[float]
    status: str  #: "converged", "limit", "failed"


class Problem:
    """minimise cost(x) subject to rows and lower <= x <= upper; x is the way from the start, which is all zeros."""

    def __init__(self, line: dict[str, Any], read: Callable[[], dict[str, Any]], write: Callable[[dict[str, Any]], None]):
        self._read, self._write = read, write
        self._asked = 0
        self._best: tuple[tuple[float, float], list[float]] | None = None
        self.num_variables: int = line["variables"]
        self.num_waypoints: int = line["waypoints"]
        self.lower = [float("-inf") if v is None else v for v in line["lower"]]
        self.upper = [float("inf") if v is None else v for v in line["upper"]]
        self.rows = [Row(r["kind"], r["first"], r["size"], r.get("weight", 0.0)) for r in line["rows"]]
        self.round: int = line["round"]  #: 0, then more about better starts, with the rows that were met
        self.seed: int = line["seed"]  #: for the solver's own draws
        self.tolerance: float = line["tolerance"]  #: violations from here on count
        self.settings: dict[str, Any] = line["settings"]  #: of the declaration

    def start(self) -> list[float]:
        """Where the solve begins."""
        return [0.0] * self.num_variables

    def evaluate(self, x: list[float], gradients: bool = False, contacts: bool = False) -> Evaluation:
        """Cost and rows at x, counted as effort. Raises Stopped."""
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
        """A line of the solve's history (legopt trace)."""
        self._write({"type": "progress", "cost": evaluation.cost, "violation": evaluation.violation})

    def solution(self, x: list[float], status: str = "converged") -> Solution:
        """What `solve` returns. `status`: converged, limit or failed."""
        return Solution([float(v) for v in x], status)

    def best(self, status: str = "limit") -> Solution:
        """The best point that was evaluated: least violation above the tolerance, then least cost."""
        return Solution(self.start() if self._best is None else self._best[1], status)


def serve(solve: Callable[[Problem], Solution], name: str, version: str, source: TextIO | None = None,
          sink: TextIO | None = None) -> None:
    """Answers every problem by solve(problem) until legopt ends it. What `solve` raises ends the process, and its last
    words are the reason that legopt reports; Stopped is answered by the best point so far."""
    source, sink = source or sys.stdin, sink or sys.stdout

    def read() -> dict[str, Any]:
        line = source.readline()
        if not line:
            raise SystemExit(0)  # legopt is gone
        return read_json(line)

    def write(message: dict[str, Any]) -> None:
        sink.write(json.dumps(message, allow_nan=False) + "\n")
        sink.flush()

    write({"type": "hello", "protocol": PROTOCOL, "name": name, "version": version})
    while True:
        line = read()
        if line["type"] == "cancel":
            continue  # of a solve that had ended already
        if line["type"] != "solve" or line["protocol"] != PROTOCOL:
            raise ProtocolError(f"expected 'solve' of protocol {PROTOCOL}, got '{line['type']}'")
        problem = Problem(line, read, write)
        try:
            solution = solve(problem)
        except Stopped:
            solution = problem.best()
        write({"type": "solution", "x": solution.x, "status": solution.status})
