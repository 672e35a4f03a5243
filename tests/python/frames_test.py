"""Tests that need NumPy and pandas."""

import importlib
import unittest

import results

import legopt
from legopt import orders
from legopt.rows import Rows


def setUpModule():
    results.require("numpy", "pandas")


class Frames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.numpy, cls.pandas = importlib.import_module("numpy"), importlib.import_module("pandas")
        cls.db = legopt.open(results.experiments().backup)
        cls.addClassCleanup(cls.db.close)

    def test_a_frame_has_the_rows(self):
        jobs = self.db.jobs()
        frame = jobs.frame()
        self.assertEqual(list(frame.columns), jobs.columns)
        self.assertEqual(len(frame), len(jobs))
        for name in jobs.columns:
            for here, there in zip(jobs.column(name), frame[name]):
                self.assertTrue(self.pandas.isna(there) if here is None else here == there, (name, here, there))

    def test_types(self):
        rows = Rows(["n", "some", "x", "mixed", "yes", "maybe", "text", "nothing"],
                    [dict(n=1, some=None, x=1.5, mixed=2, yes=True, maybe=None, text="a", nothing=None),
                     dict(n=2**53 + 1, some=2**53 + 1, x=None, mixed=2.5, yes=False, maybe=True, text=None, nothing=None)])
        frame = rows.frame()
        self.assertEqual([str(kind) for kind in frame.dtypes],
                         ["int64", "Int64", "float64", "float64", "bool", "boolean", "object", "float64"])
        self.assertEqual(frame["some"][1], 2**53 + 1)
        self.assertEqual(list(Rows(["a", "b"]).frame().columns), ["a", "b"])

    def test_the_table_by_groups(self):
        table = self.db.query("SELECT * FROM benchmark_cells WHERE rule = 'literal' AND experiment_id = 1").frame()
        jobs = self.db.jobs(1).frame()
        keys = ["method", "multi_starts", "task", "initialization"]
        grouped = jobs.groupby(keys)["solved"].agg(["size", "sum"])
        told = table.set_index(keys)
        self.assertEqual(grouped["size"].to_dict(), told["n"].to_dict())
        self.assertEqual(grouped["sum"].to_dict(), told["solved"].to_dict())

    def test_waypoints(self):
        motion = next(self.db.waypoints(job["job_id"]) for job in self.db.jobs(1).where(task="motion", solved=True))
        array, frame = motion.array(), motion.frame()
        self.assertEqual((array.shape, array.dtype), ((len(motion), len(motion.names)), self.numpy.float64))
        self.assertEqual(array.tolist(), motion.x)
        self.assertEqual(list(frame.columns), motion.names)
        self.assertEqual(frame.to_numpy().tolist(), motion.x)
        nothing = legopt.Waypoints(1, [], motion.joint_names)
        self.assertEqual(nothing.array().shape, (0, len(motion.names)))
        self.assertEqual(len(nothing.frame()), 0)

    def test_traces_and_pairs(self):
        trace = self.db.trace(1).frame()
        self.assertEqual(trace["cost"].tolist(), self.db.trace(1).column("cost"))
        pairs = self.db.paired("LegOpt-best", "SQP:multi_starts=0", 1).frame()
        self.assertEqual(str(pairs["solve_ms_b"].dtype), "float64")
        self.assertTrue(pairs["solve_ms_b"].isna().any())

    def test_orders_take_and_give_arrays(self):
        motion = next(self.db.waypoints(job["job_id"]) for job in self.db.jobs(1).where(task="motion", solved=True))
        order = orders.pinocchio(motion.joint_names, sorted(motion.joint_names))
        q = order.from_legopt(motion.array())
        self.assertIsInstance(q, self.numpy.ndarray)
        self.assertEqual(q.tolist(), order.from_legopt(motion.x))
        self.assertTrue((order.to_legopt(q) == motion.array()).all())
        self.assertEqual(order.from_legopt(motion.array()[0]).shape, (order.size,))
        self.assertEqual(order.from_legopt(motion.frame()).tolist(), q.tolist())
