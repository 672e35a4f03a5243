"""Runs of legopt on a cluster, and checks of their results."""
import functools
import json
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile

import cluster as engine

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve()
INTERRUPTED, UNREACHABLE, REFUSED = 8, 3, 14  # app/exit_codes.h
CHARGED = "SELECT count(*) FROM jobs WHERE attempts - returned > 1 OR state = 'dead'"
BITS = ("""SELECT job_id, solver_status, solver_cost, cost, iterations, term_evaluations, verdict_solid FROM results
    ORDER BY job_id""",
        "SELECT job_id, waypoint, x FROM waypoints ORDER BY job_id, waypoint")
CHARGES = "SELECT attempt, outcome, message FROM attempts WHERE outcome NOT IN ('running', 'finished', 'returned')"
POOL = """slurm: {nodes: 2, output: /tmp/%A_%a.log}
worker: {drain_s: 5, idle_timeout_s: 60, wait_server_s: 20}
"""


def expect(truth, what):
    if not truth:
        raise AssertionError(what)


def rows(database, sql, *values):
    with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
        return connection.execute(sql, values).fetchall()


class Run:
    """A background process 'legopt run SUITE --slurm' in its own folder."""

    def __init__(self, folder, suite, pool, *arguments, environment=None):
        self.folder = pathlib.Path(folder)
        self.database = self.folder / "run.sqlite"
        (self.folder / "pool.yaml").write_text(pool, encoding="utf-8")
        self._errors = open(self.folder / "errors", "w+b")
        command = [PROGRAMS / "legopt", "run", suite, "--slurm", "pool.yaml", "--db", self.database, *arguments]
        self.process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=self._errors, text=True,
                                        env=environment)

    def errors(self):
        return (self.folder / "errors").read_text(errors="replace")

    def end(self, timeout_s=120):
        """Waits for the end; returns exit status and standard output."""
        try:
            out, _ = self.process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired as expired:
            self.process.kill()
            raise AssertionError(f"legopt run did not end: {self.errors()}") from expired
        return self.process.returncode, out

    def rows(self, sql, *values):
        """Returns rows of its database; none if it does not exist yet."""
        try:
            return rows(self.database, sql, *values)
        except sqlite3.OperationalError:
            return []


def server_of(run):
    """Returns the process id of its server; None if it has none."""
    found = engine.run("pgrep", "--full", f"legopt-server --db {run.database}", check=False).stdout.split()
    return int(found[0]) if found else None


def server_status(run):
    """Returns its server's status; empty if there is no server."""
    server = server_of(run)
    if not server:
        return {}
    words = pathlib.Path(f"/proc/{server}/cmdline").read_text(encoding="utf-8").split("\0")
    flags = [word for i, flag in enumerate(words) if flag in ("--port", "--key-file", "--group")
             for word in (flag, words[i + 1])]
    status = engine.run(PROGRAMS / "legopt", "status", "--format", "json", *flags, check=False)
    return json.loads(status.stdout) if status.returncode == 0 else {}


@functools.cache
def local_bits():
    """Returns the results of 'quick' on this machine, without Slurm."""
    with tempfile.TemporaryDirectory(prefix="legopt-slurm-") as folder:
        database = pathlib.Path(folder) / "local.sqlite"
        engine.run(PROGRAMS / "legopt", "run", "quick", "--db", database, timeout=120)
        return [rows(database, sql) for sql in BITS]


def check_bits(run):
    """Checks a run of 'quick': every job is done with the bits of this machine."""
    check_whole(run, 550)
    expect([run.rows(sql) for sql in BITS] == local_bits(), "other bits than on one machine")


def check_whole(run, jobs):
    """Checks that every job has one result and none was charged twice."""
    expect(run.rows("SELECT count(*) FROM results") == [(jobs,)], run.rows("SELECT state, count(*) FROM jobs GROUP BY 1"))
    expect(run.rows(CHARGED) == [(0,)], run.rows("SELECT * FROM attempts WHERE outcome NOT IN ('finished', 'returned')"))


def check_nothing_left(cluster):
    engine.wait_for("an empty queue", lambda: not cluster.jobs())
    for node in cluster.nodes:
        engine.wait_for(f"{node.name} without workers", lambda node=node: not node.processes("legopt-worker"))


# Jobs of ten seconds and more on the default dataset, enough of them for any small cluster, so that every disturbance
# of a worker interrupts jobs.
LONG = """tasks: [motion]
initializations: [good]
repetitions: 100
methods: [{name: Adam, solver: adam, multi_starts: 10}]
"""


SHORT = """tasks: [posture]
initializations: [good]
methods: [{name: SQP, solver: sqp}]
"""


class ShortRun(Run):
    """A run of SHORT."""

    def __init__(self, folder, pool=POOL, environment=None):
        (folder / "short.yaml").write_text(SHORT, encoding="utf-8")
        super().__init__(folder, "short.yaml", pool, environment=environment)


class LongRun(Run):
    """A run of LONG; the constructor returns when this number of workers are solving jobs."""

    def __init__(self, folder, pool=POOL, workers=2, arguments=(), patience_s=40):
        (folder / "long.yaml").write_text(LONG, encoding="utf-8")
        super().__init__(folder, "long.yaml", pool, *arguments)
        engine.wait_for("workers amid jobs", lambda: len(self.at_work()) == workers or self.process.poll() is not None,
                        patience_s)
        expect(self.process.poll() is None, self.errors())
        self.job = (folder / "run.sqlite.pool" / "jobs").read_text().split()[-1]

    def at_work(self):
        """Returns {host: name of its worker} of those that have jobs now."""
        return dict(self.rows("SELECT hostname, name FROM attempts JOIN workers USING (worker_id)"
                              " WHERE outcome = 'running'"))

    def leases(self):
        """Returns {(job, attempt): name of its worker} of the running attempts."""
        return {(job, attempt): name for job, attempt, name in self.rows(
            "SELECT job_id, attempt, name FROM attempts JOIN workers USING (worker_id) WHERE outcome = 'running'")}

    def check_kept(self, leases):
        """Checks that each of these attempts still runs on its worker or has delivered its result. A job may end at any
        moment, so a worker may have no running attempt just now without having lost one."""
        for (job, attempt), worker in leases.items():
            now = self.rows("SELECT name, outcome FROM attempts JOIN workers USING (worker_id)"
                            " WHERE job_id = ? AND attempt = ?", job, attempt)
            expect(now in ([(worker, "running")], [(worker, "finished")]), f"job {job}, attempt {attempt} of {worker}: {now}")

    def interrupt(self):
        """Sends Ctrl-C."""
        self.process.send_signal(signal.SIGINT)
        status, _ = self.end(60)
        expect(status == INTERRUPTED, f"status {status}: {self.errors()}")

    def stop(self):
        """Sends Ctrl-C and waits until all running jobs are released."""
        self.interrupt()
        expect(self.rows("SELECT * FROM attempts WHERE outcome = 'running'") == [], "attempts that nobody gave back")

    def check_uncharged(self):
        charged = self.rows(CHARGES)
        expect(not charged, f"charged: {charged}")
