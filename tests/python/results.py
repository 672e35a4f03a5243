"""Common parts of the tests of the Python package: the programs of a build, and a database of a few small experiments
made by them."""

import contextlib
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PACKAGE = SOURCE / "python"
KNEES_BENT = ("l_hip_pitch=-0.45,l_knee=0.9,l_ankle_pitch=-0.45,r_hip_pitch=-0.45,r_knee=0.9,r_ankle_pitch=-0.45")
sys.path[:0] = [str(PACKAGE), str(SOURCE / "tests" / "interop")]

# Two experiments of the small biped: postures and motions, solved and unsolved, repetitions, methods of one name. The
# second reuses results of the first and has fewer methods and problems.
FIRST = {"name": "first", "tasks": ["posture", "motion"], "repetitions": 2, "initializations": ["good", "in_collision"],
         "methods": [{"name": "SQP", "solver": "sqp", "multi_starts": [0, 10]},
                     {"name": "LegOpt-best", "solver": "best"}]}
SECOND = {"name": "second", "tasks": [{"task": "posture", "problems": [0, "3-5"]}], "repetitions": 1,
          "initializations": ["in_collision"], "methods": [{"name": "SQP", "solver": "sqp", "multi_starts": 10},
                                                           {"name": "SQP", "solver": "sqp", "collision": "surface"}]}

_build = Path()
_shared = None


def use_build(folder):
    """Sets the folder of the programs; must be called first."""
    global _build
    _build = Path(folder).resolve()
    os.environ["LEGOPT"] = str(_build / "legopt")


def build():
    return _build


def legopt(*arguments, folder=None):
    """Returns the output of the program. RuntimeError if it refused."""
    done = subprocess.run([str(_build / "legopt"), *map(str, arguments)], text=True, stdin=subprocess.DEVNULL,
                          capture_output=True, check=False, cwd=folder, env=environment())
    if done.returncode != 0:
        raise RuntimeError(f"legopt {arguments}: {done.returncode}: {done.stderr}")
    return done.stdout


def environment():
    """Returns the environment without the shell's settings of deployments and plotting."""
    foreign = ("LEGOPT_KEY_FILE", "LEGOPT_DEPLOYMENT", "LEGOPT_PORT", "LEGOPT_GROUP", "COLUMNS")
    return {name: value for name, value in os.environ.items() if name not in foreign}


class Experiments:
    """A folder with the biped's dataset and the database results.sqlite."""

    def __init__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="legopt-python-"))
        self.db = self.folder / "results.sqlite"
        self.dataset = self.folder / "biped"
        legopt("import", SOURCE / "data" / "biped", "--out", self.dataset, "--nominal", KNEES_BENT)
        for suite in (FIRST, SECOND):
            legopt("run", self.suite(suite), "--dataset", self.dataset, "--db", self.db)
        # A backup has no side files.
        self.backup = self.folder / "backup.sqlite"
        legopt("service", "backup", "--db", self.db, self.backup)

    def suite(self, suite):
        """Returns the file of a suite."""
        path = self.folder / f"{suite['name']}.yaml"
        path.write_text(json.dumps(suite))
        return path

    def copy(self, name="copy.sqlite"):
        """Returns a private copy of the database without side files."""
        path = Path(tempfile.mkdtemp(dir=self.folder)) / name
        shutil.copyfile(self.backup, path)
        return path

    def listing(self, *arguments, db=None):
        """Returns rows of a listing of the program, as in JSON."""
        return json.loads(legopt(*arguments, "--db", db or self.backup, "--format", "json"))

    def query(self, sql, db=None):
        return self.listing("query", sql, db=db)


def experiments():
    """Returns the experiments shared by all tests of a process."""
    global _shared
    if _shared is None:
        _shared = Experiments()
        unittest.addModuleCleanup(forget)
    return _shared


def forget():
    global _shared
    if _shared is not None:
        shutil.rmtree(_shared.folder)
        _shared = None


def require(*packages):
    """Skips the test with a message if a Python package is missing."""
    missing = [package for package in packages if importlib.util.find_spec(package) is None]
    if missing:
        raise unittest.SkipTest("NO " + ", ".join(missing).upper() + " HERE: apt install "
                                + " ".join("python3-" + package for package in missing))


def content(folder):
    """Returns names and hashes of all files below a folder."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in Path(folder).rglob("*") if path.is_file()}


@contextlib.contextmanager
def serving(db):
    """Runs a server on the database; yields a function that runs `legopt` against it."""
    import frames
    from deployment import GROUP, free_ports
    try:
        frames.check_route(GROUP, 1)
    except OSError as error:
        raise unittest.SkipTest(f"NO MULTICAST HERE: {error}") from error
    network = ["--port", str(free_ports())]
    server = subprocess.Popen([str(_build / "legopt-server"), "--db", str(db), *network], text=True, env=environment(),
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        if not any("ready" in line for line in server.stdout):
            raise RuntimeError("the server does not start")
        yield lambda *arguments: legopt(*arguments, *network, "--timeout", "30")
    finally:
        server.terminate()
        server.communicate()
