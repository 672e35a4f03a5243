"""Jobs "solved" from a LegOpt solution file and judged by legopt's own judge, so that reports are correct."""

import json
import subprocess

NAN = float("nan")  # not available
JUDGES_FIGURES = (
    "cost", "interpolation_environment_depth_m", "interpolation_self_depth_m", "interpolation_free_share")
TIMING = {  # field: that of the object "timing" in evaluate's JSON
    "duration_s": "duration_s", "reduced_duration_s": "reduced_s", "velocity_limited_share": "velocity",
    "torque_limited_share": "torque", "contact_limited_share": "contact"}
NO_SOLVER = {"solver_status": "not_run", "solver_cost": NAN, "solver_violation": NAN}
FINISHED = 0
HELD = {"holding": "holding", "halfway": "holding_halfway"}  # prefix of fields: object in evaluate's JSON


def dataset_facts(legopt, folder):
    """Returns the dataset_ref of a dataset folder."""
    (facts,) = json.loads(_run(legopt, "dataset", "info", folder, "--format", "json"))
    return {"name": facts["name"], "hash": facts["hash"]}


def no_answer(outcome, text):
    """Returns the fields of the result_request of an attempt without a solution."""
    return {"outcome": outcome, "message": text, "failed_waypoint": -1, **NO_SOLVER,
            **dict.fromkeys([*JUDGES_FIGURES, *TIMING], NAN)}


class Answers:
    """The solutions of one file, by task and problem."""

    def __init__(self, legopt, folder, file):
        with open(file, encoding="utf-8") as text:
            solutions = json.load(text)
        judged = json.loads(_run(legopt, "evaluate", file, "--dataset", folder, "--format", "json"))
        self._task = solutions["task"]
        self._waypoints = {
            problem["id"]: [[float(number) for number in waypoint.split()] for waypoint in problem["solution"][0]["x"]]
            for problem in solutions["problems"]}
        self._judged = {solution["problem"]: solution for solution in judged["solutions"]}

    def solve(self, lease):
        """Returns the fields of the result_request that describe the solution; None if this job has none."""
        if lease.task != self._task or lease.problem_id not in self._waypoints:
            return None
        waypoints = self._waypoints[lease.problem_id]
        judged = self._judged[lease.problem_id]
        failed = judged["failed_waypoint"]
        return {
            "outcome": FINISHED, **NO_SOLVER,
            "verdict_literal": judged["verdict_literal"], "verdict_strict": judged["verdict_strict"],
            "verdict_solid": judged["verdict_solid"], "verdict_physical": judged["verdict_physical"],
            "verdict_detail": judged["detail"],
            "failed_waypoint": -1 if failed is None else failed,
            **{name: NAN if judged[name] is None else judged[name] for name in JUDGES_FIGURES},
            **_timing(judged["timing"]),
            "violations": [
                {"check": value["check"], "rule": value["rule"], "subject": value["subject"], "value": value["value"],
                 "waypoint": -1 if value["waypoint"] is None else value["waypoint"]}
                for value in judged["violations"] if value["value"] is not None],
            **{f"{name}_{count}": judged[place][count] for name, place in HELD.items()
               for count in ("postures", "without_equilibrium", "over_torque")},
            "num_waypoints": len(waypoints), "waypoint_size": len(waypoints[0]),
            "waypoints": [number for waypoint in waypoints for number in waypoint],
        }


def _timing(judged):
    timed = judged is not None and judged["duration_s"] is not None
    return {field: judged[name] if timed and judged[name] is not None else NAN for field, name in TIMING.items()}


def _run(*command):
    return subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE).stdout
