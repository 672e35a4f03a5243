"""Coordinate orders of other libraries: known vectors computed by hand, and round trips."""

import math
import random
import unittest
from types import SimpleNamespace

import results  # noqa: F401  (the path of the package)

from legopt import RequestError, Waypoints, orders

NAMES = ["l_hip", "l_knee", "r_hip", "r_knee"]
X = [0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 3.0, 0.5, 0.1, -0.7, 0.5]  # joints, x y z, w x y z


def pinocchio_model(widths=None, names=None):
    """Returns an imitation of pinocchio.Model: joint 0 is the universe, joints in alphabetical order."""
    names = names or ["universe", "root_joint", *sorted(NAMES, reverse=True)]
    widths = widths or [0, 7] + [1] * (len(names) - 2)
    starts = [sum(widths[:i]) for i in range(len(widths))]
    return SimpleNamespace(names=names, nqs=widths, idx_qs=starts, nq=sum(widths))


def drake_plant(found):
    """Returns an imitation of a MultibodyPlant; `found`: name, start, number of positions, model instance."""
    joints = [SimpleNamespace(name=lambda n=name: n, position_start=lambda s=start: s, num_positions=lambda w=width: w)
              for name, start, width, _ in found]
    return SimpleNamespace(
        GetJointIndices=lambda instance=None: [i for i, row in enumerate(found) if instance in (None, row[3])],
        get_joint=lambda i: joints[i])


def mujoco_model(kinds, names):
    widths = [{0: 7, 1: 4, 2: 1, 3: 1}[kind] for kind in kinds]
    return SimpleNamespace(njnt=len(kinds), jnt_type=kinds, nq=sum(widths),
                           jnt_qposadr=[sum(widths[:i]) for i in range(len(widths))],
                           joint=lambda i: SimpleNamespace(name=names[i]))


class KnownValues(unittest.TestCase):
    def both_ways(self, order, q):
        self.assertEqual(order.from_legopt(X), q)
        self.assertEqual(order.to_legopt(q), X)
        self.assertEqual(order.size, len(q))

    def test_pinocchio(self):
        q = [1.0, 2.0, 3.0, 0.1, -0.7, 0.5, 0.5, 0.4, 0.3, 0.2, 0.1]
        self.both_ways(orders.pinocchio(NAMES, pinocchio_model()), q)
        for names in (["universe", "root_joint", *reversed(NAMES)], list(reversed(NAMES))):
            self.both_ways(orders.pinocchio(NAMES, names), q)

    def test_pinocchio_has_cos_and_sin_of_unbounded_joints(self):
        names = ["universe", "root_joint", "r_knee", "l_hip", "l_knee", "r_hip"]
        for order in (orders.pinocchio(NAMES, pinocchio_model([0, 7, 1, 2, 1, 1], names)),
                      orders.pinocchio(NAMES, names, continuous=["l_hip"])):
            q = order.from_legopt(X)
            self.assertEqual(q[7:], [0.4, math.cos(0.1), math.sin(0.1), 0.2, 0.3])
            self.assertAlmostEqual(order.to_legopt(q)[0], 0.1, places=15)

    def test_drake(self):
        q = [0.5, 0.1, -0.7, 0.5, 1.0, 2.0, 3.0, 0.3, 0.1, 0.2, 0.4]
        plant = drake_plant([("l_knee", 9, 1, 1), ("weld", 0, 0, 1), ("pelvis", 0, 7, 1), ("r_hip", 7, 1, 1),
                             ("l_hip", 8, 1, 1), ("r_knee", 10, 1, 1)])
        self.both_ways(orders.drake(NAMES, plant), q)
        self.both_ways(orders.drake(NAMES, ["r_hip", "l_hip", "l_knee", "r_knee"]), q)

    def test_drake_of_one_model_instance(self):
        plant = drake_plant([("box", 0, 7, 2), ("pelvis", 7, 7, 1), ("l_hip", 14, 1, 1), ("drawer", 15, 1, 2),
                             ("l_knee", 16, 1, 1), ("r_hip", 17, 1, 1), ("r_knee", 18, 1, 1)])
        self.both_ways(orders.drake(NAMES, plant, 1), [0.5, 0.1, -0.7, 0.5, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4])
        with self.assertRaisesRegex(RequestError, "2 floating bases .'box', 'pelvis'.*model_instance"):
            orders.drake(NAMES, plant)

    def test_mujoco(self):
        q = [1.0, 2.0, 3.0, 0.5, 0.1, -0.7, 0.5, 0.1, 0.3, 0.2, 0.4]
        names = ["l_hip", "r_hip", "l_knee", "r_knee"]
        self.both_ways(orders.mujoco(NAMES, mujoco_model([0, 3, 2, 3, 3], ["", *names])), q)
        self.both_ways(orders.mujoco(NAMES, names), q)

    def test_several_vectors_and_waypoints(self):
        order = orders.mujoco(NAMES, NAMES)
        other = [value + 1 for value in X]
        q = order.from_legopt(Waypoints(3, [X, other], NAMES))
        self.assertEqual(q, [order.from_legopt(X), order.from_legopt(other)])
        self.assertEqual(order.to_legopt(q), [X, other])
        self.assertEqual(order.from_legopt(Waypoints(3, [], NAMES)), [])

    def test_there_and_back_in_random_orders(self):
        random.seed(1)
        for _ in range(50):
            names = [f"joint_{i}" for i in range(random.randrange(1, 40))]
            x = [random.uniform(-3, 3) for _ in range(len(names) + 7)]
            theirs = random.sample(names, len(names))
            for make in (orders.pinocchio, orders.drake, orders.mujoco):
                order = make(names, theirs)
                q = order.from_legopt(x)
                self.assertEqual(sorted(q), sorted(x))
                self.assertEqual(order.to_legopt(q), x)
                self.assertEqual(q[7:], [x[names.index(name)] for name in theirs])

    def test_the_datasets_robot(self):
        made = results.experiments()
        import legopt
        with legopt.open(made.backup) as db:
            solution = db.waypoints(1)
        order = orders.pinocchio(solution.joint_names, sorted(solution.joint_names))
        (q,) = order.from_legopt(solution)
        self.assertEqual(q[:7], solution.base_position[0] + solution.base_quaternion[0][1:] + solution.base_quaternion[0][:1])
        self.assertEqual(order.to_legopt([q]), solution.x)


class JointsThatOnlyOneHas(unittest.TestCase):
    def test_they_are_named(self):
        for make in (orders.pinocchio, orders.drake, orders.mujoco):
            with self.assertRaisesRegex(RequestError, "does not have 'r_knee'; legopt's robot does not have 'finger'; say "
                                                      "where they are held: others={'r_knee': 0.0}"):
                make(NAMES, NAMES[:3] + ["finger"])

    def test_they_are_held_where_the_caller_says(self):
        order = orders.drake(NAMES, NAMES[:3] + ["finger"], others={"r_knee": 0.4, "finger": -1.5})
        q = order.from_legopt(X)
        self.assertEqual(q[7:], [0.1, 0.2, 0.3, -1.5])
        self.assertEqual(order.to_legopt(q), X)

    def test_what_cannot_be_shown_is_an_error(self):
        order = orders.drake(NAMES, NAMES[:3] + ["finger"], others={"r_knee": 0.0, "finger": 0.0})
        with self.assertRaisesRegex(RequestError, "joint 'r_knee' is at 0.4, and the model of Drake holds it at 0"):
            order.from_legopt(X)
        with self.assertRaisesRegex(RequestError, "joint 'finger' of Drake is at 2, and legopt's robot holds it at 0"):
            order.to_legopt([1.0] * 10 + [2.0])
        with self.assertRaisesRegex(RequestError, "others: neither robot has a joint 'toe'"):
            orders.drake(NAMES, NAMES, others={"toe": 0.0})


class WrongModels(unittest.TestCase):
    def test_they_are_told(self):
        free = pinocchio_model([0, 1, 1, 1, 1], ["universe", *NAMES])
        wrong = [(lambda: orders.pinocchio(NAMES, free), "no floating base; build the model with .*JointModelFreeFlyer"),
                 (lambda: orders.pinocchio(NAMES, pinocchio_model([0, 7, 1, 1, 1, 4])),
                  "'l_hip' of Pinocchio: neither revolute nor prismatic"),
                 (lambda: orders.mujoco(NAMES, mujoco_model([0, 1, 3, 3, 3], ["", *NAMES])), "'l_hip' of MuJoCo: neither"),
                 (lambda: orders.mujoco(NAMES, mujoco_model([3, 3, 3, 3], NAMES)), "no floating base; .*<freejoint/>"),
                 (lambda: orders.drake(NAMES, drake_plant([("l_hip", 0, 1, 1)])), "no floating base"),
                 (lambda: orders.mujoco(NAMES, [*NAMES, "l_hip"]), "MuJoCo has several joints 'l_hip'"),
                 (lambda: orders.mujoco([*NAMES, "l_hip"], NAMES), "legopt's robot has several joints 'l_hip'"),
                 (lambda: orders.pinocchio(NAMES, NAMES, continuous=["toe"]), "Pinocchio's list has no joint 'toe'")]
        for make, text in wrong:
            with self.assertRaisesRegex(RequestError, text):
                make()

    def test_wrong_lengths(self):
        order = orders.pinocchio(NAMES, NAMES)
        with self.assertRaisesRegex(RequestError, "the vector has 3 numbers; those of legopt have 11 here"):
            order.from_legopt([1.0, 2.0, 3.0])
        with self.assertRaisesRegex(RequestError, "vector 1 has 10 numbers; those of Pinocchio have 11 here"):
            order.to_legopt([X, X[:-1]])
