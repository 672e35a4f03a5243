"""SciPy's SLSQP as an external solver of legopt. Requires python3-scipy and the package legopt.

Preferences are added to the cost: weight times the sum of max(v, 0).
"""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "python"))

import numpy as np  # noqa: E402
import scipy.optimize  # noqa: E402

import legopt.solver  # noqa: E402


class Point:
    """Values and derivatives at the last requested point."""

    def __init__(self, problem):
        self.problem, self.x, self.at = problem, None, None

    def evaluate(self, x):
        if self.x is None or not np.array_equal(x, self.x):
            self.x, self.at = x.copy(), self.problem.evaluate(list(x), gradients=True)
            if self.at.finite:
                self.problem.progress(self.at)
        return self.at

    def rows(self, x, kind):
        """Returns values, and a dense Jacobian, of all rows of a kind."""
        at = self.evaluate(x)
        chosen = [i for i, row in enumerate(self.problem.rows) if row.kind == kind]
        values = np.full(len(chosen), 1e6)
        jacobian = np.zeros((len(chosen), len(x)))
        if at.finite:
            for k, i in enumerate(chosen):
                row = self.problem.rows[i]
                values[k] = at.values[i]
                jacobian[k, row.first:row.first + row.size] = at.jacobian[i]
        return values, jacobian

    def cost(self, x):
        at = self.evaluate(x)
        if not at.finite:
            return 1e12, np.zeros(len(x))
        value, gradient = at.cost, np.array(at.gradient)
        for i, row in enumerate(self.problem.rows):
            if row.kind == "preference" and at.values[i] > 0:
                value += row.weight * at.values[i]
                gradient[row.first:row.first + row.size] += row.weight * np.array(at.jacobian[i])
        return value, gradient


def solve(problem):
    point = Point(problem)
    constraints = []
    for kind, word, sign in (("equality", "eq", 1.0), ("inequality", "ineq", -1.0)):
        if any(row.kind == kind for row in problem.rows):
            constraints.append({"type": word,
                                "fun": lambda x, kind=kind, sign=sign: sign * point.rows(x, kind)[0],
                                "jac": lambda x, kind=kind, sign=sign: sign * point.rows(x, kind)[1]})
    result = scipy.optimize.minimize(
        point.cost, np.array(problem.start()), jac=True, method="SLSQP",
        bounds=scipy.optimize.Bounds(problem.lower, problem.upper), constraints=constraints,
        options={"ftol": problem.settings.get("ftol", 1e-4), "maxiter": problem.settings.get("maxiter", 100)})
    return problem.solution(list(result.x), "converged") if result.success else problem.best("failed")


if __name__ == "__main__":
    legopt.solver.serve(solve, "SciPy SLSQP", scipy.__version__)
