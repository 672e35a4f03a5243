"""A solver of level "files": one Gauss-Newton step on the violated rows, with the standard library alone.

    newton_step.py PROBLEM SOLUTION

PROBLEM contains the evaluation at the start. legopt judges the result of the step, and calls the solver again from
there. """

import json
import sys


def solve_symmetric(matrix, right):
    """Solves matrix x = right for a positive definite matrix by Gaussian elimination without pivoting."""
    n = len(right)
    rows = [row + [value] for row, value in zip(matrix, right)]
    for i in range(n):
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def step(problem):
    """Returns the shortest step that satisfies every violated row to first order; a little shorter if rows conflict."""
    at, damping = problem["at_start"], 1e-6
    violated = []  # (value, {variable: derivative})
    for row, value, derivatives in zip(problem["rows"], at["values"], at["jacobian"]):
        if row["kind"] == "equality" or (row["kind"] == "inequality" and value > -1e-3):
            shift = 0.0 if row["kind"] == "equality" else 1e-4  # inequalities are satisfied with a small margin
            violated.append((value + shift, {row["first"] + i: d for i, d in enumerate(derivatives)}))
    products = [[sum(d * b.get(i, 0.0) for i, d in a.items()) for _, b in violated] for _, a in violated]
    for i in range(len(violated)):
        products[i][i] += damping
    multipliers = solve_symmetric(products, [-value for value, _ in violated])
    x = [0.0] * problem["variables"]
    for multiplier, (_, derivatives) in zip(multipliers, violated):
        for i, d in derivatives.items():
            x[i] += multiplier * d
    return x


def main():
    with open(sys.argv[1]) as file:
        problem = json.load(file)
    if not problem["at_start"]["finite"]:
        sys.exit("the start is not finite")
    longest = problem["settings"].get("longest", 0.5)
    x = step(problem)
    scale = min(1.0, longest / max(max(map(abs, x)), 1e-12))
    with open(sys.argv[2], "w") as file:
        json.dump({"x": [scale * value for value in x]}, file)


main()
