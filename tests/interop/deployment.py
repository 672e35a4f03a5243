"""A deployment for one test: free ports, a new folder, a real server, the legopt client."""

import contextlib
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

GROUP = "239.255.76.67"
SOURCE = Path(__file__).resolve().parents[2]
DATASET = SOURCE / "data" / "garage-easier"
SOLUTIONS = DATASET / "solutions-posture.json"
PATIENCE_S = 40.0
BETWEEN_LOOKS_S = 0.05
# Below the system's ephemeral ports.
PORTS = range(20000, 32000, 2)


def free_ports():
    """Returns a port that is unused, as is the next one."""
    while True:
        port = random.choice(PORTS)
        with contextlib.ExitStack() as sockets:
            try:
                for number in (port, port + 1):
                    sockets.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)).bind(("", number))
                return port
            except OSError:
                continue


class Deployment:
    """A deployment, used as a context manager. `key` creates a key, `number` is the deployment's; all its programs
    use them."""

    def __init__(self, build, key=False, number=None):
        self._build = Path(build)
        self.folder = Path(tempfile.mkdtemp(prefix="legopt-interop-"))
        self.port = free_ports()
        self.key_file = self.folder / "key" if key else None
        self.server = None
        self._workers = []
        own = {"LEGOPT_GROUP": GROUP, "LEGOPT_PORT": str(self.port), "LEGOPT_DATA": str(SOURCE / "data")}
        foreign = ("LEGOPT_KEY_FILE", "LEGOPT_DEPLOYMENT")
        self._environment = {name: value for name, value in os.environ.items() if name not in foreign} | own
        if number:
            self._environment["LEGOPT_DEPLOYMENT"] = str(number)
        if key:
            self.client("service", "keygen", self.key_file)
            self._environment["LEGOPT_KEY_FILE"] = str(self.key_file)

    def __enter__(self):
        self.start_server()
        return self

    def __exit__(self, *_):
        for process in [*self._workers, self.server]:
            process.kill()
            process.communicate()
        shutil.rmtree(self.folder)

    def start_server(self):
        """Starts the server and returns when it is ready."""
        self.server = self._start(self._build / "legopt-server", "--db", self.folder / "results.sqlite")
        for line in self.server.stdout:
            if "ready" in line:
                return
        raise RuntimeError("the server does not start: " + self.server.stderr.read())

    def kill_server(self):
        self.server.kill()
        self.server.communicate()

    def start_worker(self, *arguments):
        """Starts the Python worker."""
        worker = self._start(sys.executable, SOURCE / "tests" / "interop" / "worker.py", "--legopt",
                             self._build / "legopt", "--dataset", DATASET, "--solutions", SOLUTIONS, *arguments)
        self._workers.append(worker)
        return worker

    def _start(self, *command):
        return subprocess.Popen([str(word) for word in command], env=self._environment, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def call(self, command, *arguments):
        """Runs a `legopt` command that calls the server, with a long time-out; returns its output."""
        return self.client(command, *arguments, "--timeout", "30")

    def client(self, *arguments):
        """Runs `legopt`; returns its output."""
        done = subprocess.run([str(self._build / "legopt"), *map(str, arguments)], env=self._environment, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"legopt {arguments}: {done.stderr}")
        return done.stdout

    def submit(self, tasks, repetitions=1, max_attempts=3):
        """Submits an experiment from good starts by a method that no worker here implements; returns its id."""
        suite = self.folder / "suite.yaml"
        suite.write_text(json.dumps({
            "name": "interop", "dataset": str(DATASET), "tasks": tasks, "repetitions": repetitions,
            "initializations": ["good"], "max_attempts": max_attempts, "methods": [{"name": "SQP", "solver": "sqp"}]}))
        return int(self.call("submit", suite))

    def query(self, sql):
        """Returns rows as tuples."""
        return [tuple(row.values()) for row in json.loads(self.call("query", sql, "--format", "json"))]

    def jobs(self, experiment):
        """Returns the numbers of jobs by state."""
        (facts,) = json.loads(self.call("status", "--format", "json"))["experiments"]
        assert facts["id"] == experiment
        return facts["jobs"]

    def counters(self):
        """Returns the transport counters of the server."""
        return json.loads(self.call("status", "--format", "json"))["server"]["transport"]

    def wait_for(self, experiment, state, count):
        """Waits until `count` jobs are in a state."""
        end = time.monotonic() + PATIENCE_S
        while self.jobs(experiment)[state] < count:
            if time.monotonic() > end:
                raise RuntimeError(f"no {count} jobs are {state}: {self.jobs(experiment)}")
            time.sleep(BETWEEN_LOOKS_S)


def end(process):
    """Sends SIGTERM to a process; returns its exit code and output."""
    process.send_signal(signal.SIGTERM)
    return leave(process)


def leave(process):
    """Waits until a process ends; returns its exit code and output."""
    _, words = process.communicate(timeout=PATIENCE_S)
    return process.returncode, words
