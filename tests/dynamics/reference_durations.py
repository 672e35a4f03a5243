#!/usr/bin/env python3
"""Compares the durations of `legopt evaluate --durations` with a separate implementation.

    reference_durations.py LEGOPT DATASET [--motions N] [--stances N] [--solutions FILE]

Takes the first stances of each planted motion of a dataset of contacts. The grid is legopt's; everything else is
separate: SciPy's natural spline, poses from the URDF, accelerations by differences along the curve, torques by virtual work, and T* as a sequence of
sparse linear programs with the contact forces of all grid points as variables and a trust region on x. Prints both
durations of each motion; exit code 1 if they differ by more than 0.5 %, 77 (skipped) without SciPy."""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

try:
    import numpy as np
    import scipy.optimize
    import scipy.sparse
    import yaml
    from scipy.interpolate import CubicSpline
except ImportError as error:
    print(f"reference_durations: skipped: {error}", file=sys.stderr)
    sys.exit(77)

TOLERANCE = 0.005
PER_PIECE, PER_SEGMENT = 4, 32


def numbers(text):
    return np.array([float(word) for word in text.replace(",", " ").split()])


def rotation_rpy(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return (np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
            @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]))


def rotation_quaternion(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def rotation_axis(axis, angle):
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def frame(element):
    origin = element.find("origin") if element is not None else None
    if origin is None:
        return np.eye(3), np.zeros(3)
    return rotation_rpy(numbers(origin.get("rpy", "0 0 0"))), numbers(origin.get("xyz", "0 0 0"))


class Robot:
    """A tree of revolute and fixed joints without couplings; joints in depth-first order of the file."""

    def __init__(self, path):
        root = ElementTree.parse(path).getroot()
        links = {link.get("name"): link for link in root.findall("link")}
        children = {}
        for joint in root.findall("joint"):
            children.setdefault(joint.find("parent").get("link"), []).append(joint)
        child_names = {j.find("child").get("link") for js in children.values() for j in js}
        (base,) = [name for name in links if name not in child_names]
        self.names, self.parent, self.joint, self.dof_of = [base], [-1], [None], [-1]
        self.effort, self.velocity = [], []
        self.visit(base, 0, children)
        self.mass, self.com, self.inertia = [], [], []
        for name in self.names:
            inertial = links[name].find("inertial")
            R, p = frame(inertial)
            tensor = np.zeros((3, 3))
            if inertial is not None:
                i = inertial.find("inertia")
                xx, xy, xz, yy, yz, zz = [float(i.get(k, "0")) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
                tensor = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
            self.mass.append(0.0 if inertial is None else float(inertial.find("mass").get("value")))
            self.com.append(p)
            self.inertia.append(tensor)
        self.mass = np.array(self.mass)
        self.n = len(self.effort)

    def visit(self, link, index, children):
        for joint in children.get(link, []):
            limit = joint.find("limit")
            moves = joint.get("type") != "fixed"
            self.names.append(joint.find("child").get("link"))
            self.parent.append(index)
            self.joint.append((*frame(joint), numbers(joint.find("axis").get("xyz")) if moves else None))
            self.dof_of.append(len(self.effort) if moves else -1)
            if moves:
                self.effort.append(float(limit.get("effort")))
                self.velocity.append(float(limit.get("velocity")))
            self.visit(self.names[-1], len(self.names) - 1, children)

    def poses(self, x):
        R, p, axes = [rotation_quaternion(x[-4:])], [x[self.n:self.n + 3]], [None]
        for k in range(1, len(self.names)):
            Rj, pj, axis = self.joint[k]
            up = self.parent[k]
            Rk, pk = R[up] @ Rj, p[up] + R[up] @ pj
            if axis is not None:
                Rk = Rk @ rotation_axis(axis / np.linalg.norm(axis), x[self.dof_of[k]])
            R.append(Rk)
            p.append(pk)
            axes.append(None if axis is None else Rk @ axis / np.linalg.norm(axis))
        return R, p, axes

    def carries(self, k):
        """Links whose motion a joint causes."""
        below = {k}
        for link in range(k + 1, len(self.names)):
            if self.parent[link] in below:
                below.add(link)
        return below


def unskew(M):
    return np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]]) / 2


def path_of(solution, size):
    times, points = [], []
    for k, text in enumerate(solution["x"]):
        v = numbers(text) if isinstance(text, str) else np.array(text)
        times.append(v[-1] if len(v) > size else float(k))
        points.append(v[:size])
    return np.array(times), np.array(points)


def stance_of(text):
    tokens = text["contacts"].split(",")
    stance = {}
    for name, pose in zip(tokens[0::2], tokens[1::2]):
        stance[name] = (numbers(pose), text.get("friction", {}).get(name))
    return stance


class Curve:
    def __init__(self, times, points):
        points = points.copy()
        for i in range(len(points)):
            points[i, -4:] /= np.linalg.norm(points[i, -4:])
            if i and points[i, -4:] @ points[i - 1, -4:] < 0:
                points[i, -4:] *= -1
        self.spline = CubicSpline(times, points, bc_type="natural")

    def __call__(self, s):
        return self.spline(s)


def generators(stance, contacts, robot, poses):
    """Points, directions and links of the edges of all friction pyramids. Contacts of kind point and sole."""
    rows = []
    for name, (pose, friction) in stance.items():
        contact = contacts[name]
        R, p = rotation_quaternion(pose[:4]), pose[4:]
        link = robot.names.index(contact["link"])
        Rc, pc = rotation_rpy(np.array(contact["frame"]["rpy"])), np.array(contact["frame"]["position"])
        places = [p] if contact["kind"] == "point" else None
        assert places is not None, "only contacts of kind point"
        mu = friction if friction is not None else contact["friction"]
        for place in places:
            for e in range(8):
                a = e * np.pi / 4
                rows.append((link, place, R @ np.array([mu * np.cos(a), mu * np.sin(a), 1.0])))
    return rows


def coefficients(robot, curve, s, gravity, end):
    """Momentum rates and torques for (u, x) = (1, 0) and (0, 1), and the pose, by central differences along s."""
    h = 1e-4
    at = min(max(s, h), end - h)  # one-sided places are shifted inwards by less than the tolerance
    before, here, after = (robot.poses(curve(at + d)) for d in (-h, 0.0, h))
    M = robot.mass.sum()
    com = sum(m * (p + R @ c) for m, R, p, c in zip(robot.mass, here[0], here[1], robot.com)) / M
    out = []
    force_of, moment_of = [], []
    for k, m in enumerate(robot.mass):
        c = [poses[1][k] + poses[0][k] @ robot.com[k] for poses in (before, here, after)]
        c_s, c_ss = (c[2] - c[0]) / (2 * h), (c[2] - 2 * c[1] + c[0]) / h ** 2
        R = [poses[0][k] for poses in (before, here, after)]
        w_after, w_before = unskew((R[2] - R[1]) @ (R[2] + R[1]).T / 2) / h, unskew((R[1] - R[0]) @ (R[1] + R[0]).T / 2) / h
        w, w_s = (w_after + w_before) / 2, (w_after - w_before) / h
        I = R[1] @ robot.inertia[k] @ R[1].T
        force_of.append((m * c_s, m * c_ss))
        moment_of.append((I @ w, I @ w_s + np.cross(w, I @ w)))
    places = [p + R @ c for R, p, c in zip(here[0], here[1], robot.com)]
    for part in (0, 1):
        F = sum(f[part] for f in force_of)
        N = sum(np.cross(c - com, f[part]) + n[part] for c, f, n in zip(places, force_of, moment_of))
        out.append((F, N))
    torque = np.zeros((robot.n, 3))  # gravity, u, x
    for k in range(1, len(robot.names)):
        if robot.dof_of[k] < 0:
            continue
        for link in robot.carries(k):
            J = np.cross(here[2][k], places[link] - here[1][k])
            torque[robot.dof_of[k], 0] += robot.mass[link] * gravity * J[2]
            for part in (0, 1):
                torque[robot.dof_of[k], 1 + part] += J @ force_of[link][part] + here[2][k] @ moment_of[link][part]
    return com, out, torque, here


def grid_of(times, wanted):
    for refinement in range(3):
        grid = [0.0]
        first = 0
        for i in range(1, len(times)):
            if times[i] != np.floor(times[i]):
                continue
            pieces = i - first
            per_piece = max(PER_PIECE, -(-PER_SEGMENT // pieces)) << refinement
            for p in range(first, i):
                grid += list(times[p] + (times[p + 1] - times[p]) * np.arange(1, per_piece + 1) / per_piece)
            first = i
        if len(grid) == wanted:
            return np.array(grid)
    raise SystemExit(f"no grid has {wanted} points")


def shortest(robot, dataset, stances, times, points, wanted, guess_s):
    curve, grid = Curve(times, points), grid_of(times, wanted)
    gravity, contacts = dataset["gravity_m_s2"], dataset["contacts"]
    M = robot.mass.sum()
    weight = M * gravity
    rows, cols, values, low, high, top = [], [], [], [], [], []
    D, N = np.diff(grid), len(grid)
    count, row = N, 0

    def add(entries, lower, upper):
        nonlocal row
        for column, value in entries:
            rows.append(row)
            cols.append(column)
            values.append(value)
        low.append(lower)
        high.append(upper)
        row += 1

    def add_forces(s, stance, slack, motion):
        """Balance and torques with contact forces of their own; `motion(a, b)`: entries of a u + b x."""
        nonlocal count
        com, ((Fa, Na), (Fb, Nb)), torque, poses = coefficients(robot, curve, s, gravity, grid[-1])
        edges = generators(stance, contacts, robot, poses)
        for i in range(3):
            add([(count + l, e[2][i]) for l, e in enumerate(edges)] + motion(-Fa[i] / weight, -Fb[i] / weight),
                (i == 2) - slack, (i == 2) + slack)
            add([(count + l, np.cross(e[1] - com, e[2])[i]) for l, e in enumerate(edges)]
                + motion(-Na[i] / weight, -Nb[i] / weight), -slack, slack)
        for j in range(1, len(robot.names)):
            dof = robot.dof_of[j]
            if dof < 0:
                continue
            below = robot.carries(j)
            entries = [(count + l, -weight * np.cross(poses[2][j], e[1] - poses[1][j]) @ e[2])
                       for l, e in enumerate(edges) if e[0] in below]
            g, a, b = torque[dof]
            scale = 1 / robot.effort[dof]
            add([(c, scale * v) for c, v in entries + motion(a, b)], -1 - scale * g, 1 - scale * g)
        count += len(edges)

    for s, stance in ((grid[0], stances[0]), (grid[-1], stances[-1])):
        add_forces(s, stance, 1e-3, lambda a, b: [])
    for k in range(N - 1):
        here, following = stances[int(grid[k])], stances[int(grid[k]) + 1]
        planted = {c: t for c, t in here.items() if c in following and np.array_equal(t[0], following[c][0])}
        for end in (k, k + 1):
            # u = (x_k+1 - x_k) / 2 D, with x at this end
            add_forces(grid[end], planted, 2e-3,
                       lambda a, b: [(k, -a / (2 * D[k])), (k + 1, a / (2 * D[k])), (end, b)])
    for s in grid[:-1]:
        rate = np.abs(curve.spline(s, 1)[:robot.n])
        top.append(min(1e6, np.min((np.array(robot.velocity) / np.maximum(rate, 1e-12)) ** 2)))
    A = scipy.sparse.csr_matrix((values, (rows, cols)), shape=(row, count))
    constraints = scipy.optimize.LinearConstraint(A, np.array(low), np.array(high))
    A_ub = scipy.sparse.vstack([A, -A])
    b_ub = np.concatenate([high, -np.array(low)])

    def duration(x):
        return np.sum(2 * D / (np.sqrt(x[:-1]) + np.sqrt(x[1:])))

    def solve(x, trust):
        p, q = np.sqrt(np.maximum(x[:-1], 1e-14)), np.sqrt(np.maximum(x[1:], 1e-14))
        cost = np.zeros(count)
        cost[:N - 1] -= D / (p * (p + q) ** 2)
        cost[1:N] -= D / (q * (p + q) ** 2)
        cost[0] = cost[N - 1] = 0.0
        lower, upper = np.zeros(count), np.full(count, np.inf)
        upper[:N - 1] = top
        if trust is not None:
            lower[1:N - 1] = np.maximum(0.0, x[1:N - 1] * (1 - trust))
            upper[1:N - 1] = np.minimum(upper[1:N - 1], x[1:N - 1] * (1 + trust) + 1e-9)
        upper[0] = upper[N - 1] = lower[0] = lower[N - 1] = 0.0
        result = scipy.optimize.linprog(cost, A_ub=A_ub, b_ub=b_ub, bounds=np.column_stack([lower, upper]), method="highs-ds")
        return result.x[:N] if result.status == 0 else None

    # A feasible start: the largest common sum of x, then the sequence.
    x = solve(np.full(N, (grid[-1] / guess_s) ** 2), None)
    if x is None:
        return np.inf
    inner = slice(1, N - 1)
    x[inner] = np.maximum(x[inner], 1e-6 * x.max())
    trust, best = 0.5, duration(x)
    for _ in range(60):
        trial = solve(x, trust)
        if trial is None:
            trust *= 0.5
            continue
        trial[inner] = np.maximum(trial[inner], 1e-9 * trial.max())
        value = duration(trial)
        if value < best:
            gain, best, x = (best - value) / best, value, trial
            if gain < 1e-5 and trust < 0.2:
                break
            trust = min(0.7, 1.3 * trust)
        else:
            trust *= 0.4
            if trust < 1e-3:
                break
    return best


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("legopt")
    parser.add_argument("dataset")
    parser.add_argument("--motions", type=int, default=3)
    parser.add_argument("--stances", type=int, default=3)
    parser.add_argument("--solutions")
    arguments = parser.parse_args()
    with open(os.path.join(arguments.dataset, "dataset.yaml"), encoding="utf-8") as file:
        dataset = yaml.safe_load(file)
    with open(arguments.solutions or os.path.join(arguments.dataset, "solutions-motion.json"), encoding="utf-8") as file:
        solutions = json.load(file)
    robot = Robot(os.path.join(arguments.dataset, dataset["robot"]))
    last = 2 * arguments.stances - 1
    solutions["problems"] = solutions["problems"][:arguments.motions]
    for problem in solutions["problems"]:
        problem["definition"] = problem["definition"][:arguments.stances]
        for solution in problem["solution"]:
            times, _ = path_of(solution, robot.n + 7)
            solution["x"] = [x for x, t in zip(solution["x"], times) if t <= last]
    with tempfile.NamedTemporaryFile("w", suffix=".json", delete=False) as file:
        json.dump(solutions, file)
    try:
        output = subprocess.run([arguments.legopt, "evaluate", file.name, "--dataset", arguments.dataset, "--durations", "motions",
                                 "--format", "json"], check=True, capture_output=True, text=True).stdout
    finally:
        os.remove(file.name)
    worst, compared = 0.0, 0
    for problem, row in zip(solutions["problems"], json.loads(output)):
        times, points = path_of(problem["solution"][0], robot.n + 7)
        stances = [stance_of(text) for text in problem["definition"] for _ in range(2)]
        reference = shortest(robot, dataset, stances, times, points, row["grid_points"], row["duration_s"] or 10.0)
        if row["duration_s"] is None:
            print(f"motion {problem['id']}: no time law: {row['blocked_by']} at {row['blocked_at']}; reference {reference}")
            worst = max(worst, 0.0 if np.isinf(reference) else 1.0)
            continue
        compared += 1
        error = row["duration_s"] / reference - 1
        worst = max(worst, abs(error))
        print(f"motion {problem['id']}: {row['duration_s']:.5f} s, reference {reference:.5f} s, {100 * error:+.3f} %, "
              f"greedy {row['greedy_s']:.5f} s", flush=True)
    print(f"largest difference {100 * worst:.3f} %")
    sys.exit(1 if worst > TOLERANCE or compared == 0 else 0)


main()
