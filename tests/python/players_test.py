"""Players of exported motions (examples/players): they read the export, name a package that is missing, and give other
libraries the right numbers. The libraries are imitations."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import results

PLAYERS = results.SOURCE / "examples" / "players"
DATASET = results.SOURCE / "data" / "contacts-quadruped"
PACKAGES = {"play_mujoco": "mujoco", "play_drake": "pydrake", "play_pinocchio": "pinocchio", "play_rerun": "rerun"}

sys.path.insert(0, str(PLAYERS))

# Records what play_mujoco.py gives the library: each qpos is a line of standard output.
MUJOCO = '''
from types import SimpleNamespace
import json, re, sys
mjtJoint = SimpleNamespace(mjJNT_FREE=0)
class Model:
    def __init__(self, names):
        self.names, self.njnt = ["free", *names], 1 + len(names)
        self.jnt_type, self.jnt_qposadr, self.nq = [0] + [3] * len(names), [0, *range(7, 7 + len(names))], 7 + len(names)
    def joint(self, i): return SimpleNamespace(name=self.names[i])
class MjSpec:
    @staticmethod
    def from_file(path):
        spec = MjSpec()
        spec.names = sorted(re.findall(r'<joint name="([^"]+)" type="revolute"', open(path).read()))
        spec.compiler = SimpleNamespace(fusestatic=True)
        spec.worldbody = SimpleNamespace(first_body=lambda: SimpleNamespace(joints=[], add_freejoint=lambda: setattr(spec, "free", True)))
        return spec
    def compile(self):
        assert self.free and not self.compiler.fusestatic
        return Model(self.names)
class MjData:
    def __init__(self, model): self.qpos, self.time = [0.0] * model.nq, 0.0
def mj_forward(model, data): print("qpos", json.dumps([data.time, model.names[1:], data.qpos]))
'''
VIEWER = '''
import contextlib
from types import SimpleNamespace
def launch_passive(model, data): return contextlib.nullcontext(SimpleNamespace(sync=lambda: None))
'''


class Players(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.motion = Path(cls.folder.name) / "motion.json"
        results.legopt("export", "--file", DATASET / "solutions-motion.json", "--dataset", DATASET, "--problem", "0",
                       "--motion", "json", "--rate", "20", "--out", cls.motion)

    def play(self, name, packages, *arguments):
        """Runs a player with imitations of packages: module to text."""
        with tempfile.TemporaryDirectory() as folder:
            for module, text in packages.items():
                path = Path(folder) / module
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            environment = {**results.environment(), "PYTHONPATH": os.pathsep.join([folder, str(results.PACKAGE)])}
            return subprocess.run([sys.executable, "-B", PLAYERS / f"{name}.py", *map(str, arguments)], text=True,
                                  capture_output=True, check=False, env=environment, timeout=300)

    def test_each_reads_the_motion_and_names_the_package_that_is_missing(self):
        samples = len(json.loads(self.motion.read_text())["samples"])
        for name, package in PACKAGES.items():
            absent = {f"{package}/__init__.py": "raise ImportError('hidden')\n"}
            done = self.play(name, absent, self.motion, DATASET / "robot.urdf")
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn(f"12 joints, {samples} samples, ", done.stdout)
            self.assertIn(f"{name}: needs the Python package {package} (hidden); install it: pip install", done.stderr)

    def test_each_refuses_other_files(self):
        other = Path(self.folder.name) / "other.json"
        for text, fault in (("{", "cannot be read as JSON"), ("[]", "is no motion"), ('{"kind": "contact sequence"}', "is no motion"),
                            ('{"kind": "motion", "format": 99}', "has format 99")):
            other.write_text(text)
            for name in PACKAGES:
                done = self.play(name, {}, other, DATASET / "robot.urdf")
                self.assertEqual(done.returncode, 1)
                self.assertIn(f"{name}: {other}: {fault}", done.stderr)

    def test_mujoco_gets_the_joints_by_name(self):
        done = self.play("play_mujoco", {"mujoco/__init__.py": MUJOCO, "mujoco/viewer.py": VIEWER}, self.motion,
                         DATASET / "robot.urdf", "--speed", "50")
        self.assertEqual(done.returncode, 0, done.stderr)
        shown = [json.loads(line.removeprefix("qpos ")) for line in done.stdout.splitlines() if line.startswith("qpos ")]
        motion = json.loads(self.motion.read_text())
        self.assertEqual(len(shown), len(motion["samples"]))
        self.assertNotEqual(shown[0][1], motion["joints"], "the order differs")
        for (time_s, names, qpos), sample in zip(shown, motion["samples"]):
            self.assertEqual(time_s, sample["time_s"])
            self.assertEqual(qpos[:7], sample["base_position_m"] + sample["base_quaternion_wxyz"])
            self.assertEqual(dict(zip(names, qpos[7:])), dict(zip(motion["joints"], sample["positions"])))

    def test_followers_move_with_their_leaders(self):
        import motion_file

        text = json.loads(self.motion.read_text())
        leader = text["joints"][0]
        text["followers"] = [{"joint": "finger", "leader": leader, "multiplier": -2.0, "offset": 0.5}]
        changed = Path(self.folder.name) / "followers.json"
        changed.write_text(json.dumps(text))
        motion = motion_file.read(changed)
        self.assertEqual(motion.joint_names, [*text["joints"], "finger"])
        self.assertEqual(motion.num_dofs, 12)
        for vector in motion.vectors:
            self.assertEqual(len(vector), 13 + 7)
            self.assertAlmostEqual(vector[12], 0.5 - 2.0 * vector[0])
