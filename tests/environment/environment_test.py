#!/usr/bin/env python3
"""Policy: in every environment (surroundings.py), each program and command
1. ends with a documented exit code: the usual one, or one that the environment explains;
2. names the true cause in its message if the code differs;
3. leaves only the requested files behind, and those only on success; none in TMPDIR;
4. needs less than 2 % of a core when idle (servers, workers, the live page);
5. ends within 10 s of SIGTERM: servers, workers, the live page, and waiting commands (STOPPED).

environment_test.py BUILD GROUP [CLOCK_LIBRARY] [--all]: GROUP is one of GROUPS below. By default, every command is
tried in one or a few of a group's similar environments, and a selection of commands in the others; --all tries all in
all."""
import multiprocessing
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

import surroundings

SKIPPED = 77
AT_ONCE = 3             # environments; programs wait for most of the time
FIRST_PORT = 17700      # environments have eight ports each
EXIT_CODES = os.path.join(os.path.dirname(__file__), "..", "..", "app", "exit_codes.h")
DEFECT, INTERRUPTED = 70, 8
PATIENCE_S = 120        # time limit of a command on a busy machine
SETTLING_S = 40         # time until a service is idle
IDLE_SHARE, IDLE_WINDOW_S = 0.02, 1.5
END_S = 10
SUITE = """name: s
dataset: "{dataset}"
tasks: [posture]
problems: "0-1"
initializations: [good]
methods: [{{name: SQP, solver: sqp}}]
"""
LONG_SUITE = SUITE.replace("{{name: SQP, solver: sqp}}", "{{solver: sleeper}}")
POOL = """slurm: {nodes: 1}
ssh: {hosts: [here]}
"""
# The programs of Slurm and ssh; ssh's host is lost at once, with a worker that has ended well.
PLAYED = {"sbatch": "cat >/dev/null; echo 17", "squeue": "exit 0", "scancel": "exit 0", "ssh": "exit 0"}
COPY = "garage"  # of the dataset, for the command that writes into it
ACCESS = "lab.access"  # of the server that the bench runs
GROUPS = {
    "descriptors": ("usual", "closed_", "descriptors_", "inherited_"),
    "file_size": ("usual", "file_size_",),
    "resources": ("usual", "memory_", "processes_"),
    "signals": ("usual", "ignored_", "blocked_"),
    "places": ("usual", "no_proc", "no_sys", "no_dev_null", "reader_gone", "read_only", "removed", "leftover", "umask", "full_output", "no_route"),
    "variables": ("usual", "no_home", "empty_", "home_", "foreign_", "unknown_", "dumb_", "large_", "clock_"),
}


def documented_codes():
    with open(EXIT_CODES, encoding="utf-8") as file:
        codes = {int(code) for code in re.findall(r"^\s+k\w+ = (\d+),", file.read(), re.MULTILINE)}
    assert {0, 2, 70, 71} <= codes, codes
    return codes - {DEFECT}


class NoRoute(surroundings.Surrounding):
    """A network namespace in which all interfaces are down."""

    needs_root = True
    cause, codes = "multicast|route", (7,)

    def wrap(self, command):
        return ["unshare", "-n", *command]


class Command:
    def __init__(self, name, *arguments, creates=(), keeps=(), often=False, writes=False, on_path=False):
        self.name, self.arguments = name, list(arguments)
        self.creates = set(creates)  # patterns of requested files; created on success, or if only the final report
                                     # failed
        self.keeps = set(keeps)      # patterns of files that hold results and stay in any case
        self.often = often    # tried in every environment
        self.writes = writes  # tried with every limit of file sizes
        self.on_path = on_path  # needs a program of PATH: left out where there is no PATH


def commands(dataset):
    stored, quick = ["--db", "small.sqlite"], ["--timeout", "0.3"]
    of_dataset = ["--dataset", dataset]
    absent = [Command(word, word, *arguments, *quick) for word, *arguments in (
        ["status"], ["watch", "1"], ["cancel", "1"], ["pause", "1"], ["resume", "1"], ["edit", "1", "--tag", "label"], ["retry", "1"],
        ["submit", "s.yaml"])]
    absent += [Command(word, "service", word, *arguments, *quick) for word, *arguments in (
        ["delete", "1", "--yes"], ["events"], ["drain", "1"])]
    return [
        Command("version", "--version", often=True),
        Command("help", "help", "run"),
        Command("table", "table", "1", *stored, often=True),
        Command("query", "query", "SELECT * FROM job_list", *stored, "--format", "csv", often=True),
        Command("list", "list", "1", *stored), Command("show", "show", "1", *stored),
        Command("trace", "show", "1", "--trace", *stored), Command("logs", "show", "1", "--logs", *stored),
        Command("trace file", "show", "1", "--trace", *stored, "--out", "trace.csv", creates=["trace.csv"], writes=True),
        Command("compare", "compare", "1", "1", *stored),
        Command("report", "report", "1", *stored, *of_dataset, "--out", "report.html", creates=["report.html"], writes=True),
        Command("view", "view", "1", *stored, *of_dataset, "--out", "view.html", creates=["view.html"], writes=True),
        Command("export", "export", "1", *stored, *of_dataset, "--out", "solutions.json", creates=["solutions.json"],
                often=True, writes=True),
        Command("export to output", "export", "1", *stored, "--out", "-", often=True),
        Command("plot", "plot", "ecdf", *stored, "--out", "ecdf.pdf", creates=["ecdf.pdf"], writes=True),
        Command("archive", "archive", "pack", *stored, "--out", "a.legopt-archive", creates=["a.legopt-archive"], writes=True),
        Command("archive judge", "archive", "judge", "given.legopt-archive", *of_dataset, "--out", "judged.json",
                creates=["judged.json"], writes=True),
        Command("evaluate", "evaluate", "given.json", *of_dataset),
        Command("replay", "replay", "1", *stored, *of_dataset),
        Command("dataset info", "dataset", "info", dataset, often=True),
        Command("dataset check", "dataset", "check", dataset), Command("dataset hash", "dataset", "hash", COPY, writes=True),
        Command("dataset pack", "dataset", "pack", dataset, "--out", ".", creates=[r"\w+\.legopt-dataset"], writes=True),
        Command("import", "import", "no-folder", "--out", "imported"),
        Command("generate", "generate", "candidates", "--from", dataset, "--stances", "2", "--threads", "1", "--out", "generated",
                creates=["generated"], writes=True),
        Command("certify", "certify", dataset, "--starts", "5", "--threads", "1", "--out", "certificate.json",
                creates=["certificate.json"], writes=True),
        Command("check-solver", "service", "check-solver", "solver.json", *of_dataset),
        Command("doctor", "service", "doctor", *stored, often=True),
        Command("backup", "service", "backup", *stored, "copy.sqlite", creates=["copy.sqlite"], often=True, writes=True),
        Command("restore", "service", "restore", "small.sqlite", "--db", "restored.sqlite", creates=["restored.sqlite"], writes=True),
        Command("import files", "import", dataset, "--out", "imported", creates=["imported"], writes=True),
        Command("keygen", "service", "keygen", "new.key", creates=["new.key"], writes=True),
        Command("pool status", "pool", "status", "no-folder"),
        Command("pool slurm", "pool", "slurm", "pool.yaml", "--access", ACCESS, "--folder", "array", creates=["array"], writes=True,
                on_path=True),
        Command("pool ssh", "pool", "ssh", "pool.yaml", "--access", ACCESS, "--folder", "hosts", creates=["hosts"], writes=True,
                on_path=True),
        Command("dry run", "run", "s.yaml", "--dry-run"),
        Command("tap", "service", "tap", "--seconds", "0.1"),
        *absent,
        Command("run", "run", "s.yaml", "--db", "new.sqlite", "--workers", "1", keeps=["new.sqlite(-wal|-shm)?"], often=True,
                writes=True),
    ]


def services(port):
    """With the exit code after SIGTERM. The last one has a deployment of its own, at `port`."""
    return (
        (["legopt-server", "--db", "served.sqlite"], 0), (["legopt-worker", "--slots", "1"], 0),
        (["legopt", "serve", "--db", "small.sqlite", "--http-port", "0"], 0),
        (["legopt-server", "--db", "reached.sqlite", "--port", str(port), "--listen", f"127.0.0.1:{port + 2}",
          "--access", "reached.access"], 0))


STOPPED = (
    (["legopt", "run", "long.yaml", "--db", "stopped.sqlite", "--workers", "1", "--solver", "sleeper.json"], INTERRUPTED),
    (["legopt", "watch", "1", "--access", ACCESS], INTERRUPTED))


def processor_seconds(process):
    """Returns the CPU time of a process and its children; None if it has ended."""
    ticks = 0
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8", errors="replace") as file:
            fields = file.read().rpartition(")")[2].split()
        if fields[0] == "Z":
            return None
        ticks = int(fields[11]) + int(fields[12])
        with open(f"/proc/{process}/task/{process}/children", encoding="utf-8") as file:
            children = [int(word) for word in file.read().split()]
    except OSError:
        return None
    return ticks / os.sysconf("SC_CLK_TCK") + sum(processor_seconds(child) or 0 for child in children)


class Trial:
    """The commands and services of one environment, each in its own folder. `port`: of its deployment; eight are free
    from there on."""

    def __init__(self, bench, surrounding, everything, port):
        self.bench, self.surrounding, self.everything, self.port = bench, surrounding, everything, port
        self.faults = []
        self.temporary = tempfile.mkdtemp(dir=bench.scratch)
        os.chmod(self.temporary, 0o777)

    def fault(self, name, text):
        self.faults.append(f"{self.surrounding.name}: {name}: {text}")

    def start(self, command, folder):
        program = os.path.join(self.bench.build, command[0])
        environment = self.surrounding.variables({**self.bench.environment(), "LEGOPT_PORT": str(self.port), "TMPDIR": self.temporary})
        return subprocess.Popen(self.surrounding.wrap([program, *command[1:]]), cwd=folder, env=environment,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                preexec_fn=self.surrounding.prepare, start_new_session=True)

    def fresh_folder(self):
        folder = tempfile.mkdtemp(dir=self.bench.scratch)
        shutil.copytree(self.bench.template, folder, dirs_exist_ok=True)
        return self.surrounding.folder(folder)

    def judge_end(self, name, code, message, usual):
        expected = self.surrounding.codes
        if -code in self.surrounding.signals:
            return None
        if code < 0:
            meaning = signal.Signals(-code).name
            return self.fault(name, f"was ended by {meaning}")
        if code == usual:
            return None
        if code == DEFECT or code not in self.bench.documented | set(expected) or code not in expected:
            return self.fault(name, f"exit code {code}, usually {usual}: {message[-300:]!r}")
        if not self.surrounding.mute and not re.search(self.surrounding.cause, message):
            return self.fault(name, f"exit code {code} for another cause: {message[-300:]!r}")
        return None

    def judge_files(self, name, folder, before, command, code):
        created = sorted(set(os.listdir(folder)) - before - {"gone"})
        only_report_failed = self.surrounding.cause.startswith("standard output")
        patterns = command.keeps | self.surrounding.keeps | (command.creates if code in (0, 4) or only_report_failed else set())
        for file in created:
            if file == "new.sqlite" and not self.holds_results(os.path.join(folder, file)):
                self.fault(name, f"exit code {code} leaves {file} without an experiment")
            if self.surrounding.side_files and self.is_side_file(os.path.join(folder, file)):
                continue
            if not any(re.fullmatch(pattern, file) for pattern in patterns):
                self.fault(name, f"exit code {code} leaves {file}")
        for file in created:
            self.remove(os.path.join(folder, file))
        for file in sorted(os.listdir(self.temporary)):
            if not any(re.fullmatch(pattern, file) for pattern in self.surrounding.in_tmpdir):
                self.fault(name, f"exit code {code} leaves {file} in TMPDIR")
            self.remove(os.path.join(self.temporary, file))

    @staticmethod
    def is_side_file(path):
        return path.endswith(".sqlite-shm") or path.endswith(".sqlite-wal") and os.path.getsize(path) == 0

    @staticmethod
    def remove(path):
        if os.path.isdir(path):
            shutil.rmtree(path)
        elif os.path.exists(path):  # reading a database removes its side files
            os.remove(path)

    @staticmethod
    def holds_results(database):
        connection = sqlite3.connect(database)
        try:
            return connection.execute("SELECT count(*) FROM experiments").fetchone()[0] > 0
        except sqlite3.Error:
            return False
        finally:
            connection.close()

    def try_command(self, command, folder):
        before = set(os.listdir(folder))
        # A pipe rather than a file, to which a limit on file sizes would apply.
        process = self.start(["legopt", *command.arguments], folder)
        try:
            message = process.communicate(timeout=PATIENCE_S)[0].decode("utf-8", "replace")
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return self.fault(command.name, f"still runs after {PATIENCE_S} s")
        code = process.returncode
        if self.surrounding.name == "usual":
            self.bench.usual[command.name] = code
            if code in (DEFECT, 71) or code < 0:
                self.fault(command.name, f"exit code {code}: {message[-300:]!r}")
        else:
            self.judge_end(command.name, code, message, self.bench.usual[command.name])
        self.judge_files(command.name, folder, before, command, code)
        return None

    @staticmethod
    def shares_of_a_core(processes):
        """Of each in one window of time; 0 for one that has ended."""
        before, begin = [processor_seconds(each.pid) for each in processes], time.monotonic()
        time.sleep(IDLE_WINDOW_S)
        after = [processor_seconds(each.pid) for each in processes]
        window_s = time.monotonic() - begin
        return [0.0 if None in pair else (pair[1] - pair[0]) / window_s for pair in zip(before, after)]

    def lowest_shares(self, processes):
        """The share of each once all have nothing to do."""
        end = time.monotonic() + SETTLING_S
        lowest = [1.0] * len(processes)
        while max(lowest) >= IDLE_SHARE and time.monotonic() < end:
            lowest = [min(pair) for pair in zip(lowest, self.shares_of_a_core(processes))]
        return lowest

    def try_services(self):
        """Tries all services at once, since they mostly wait."""
        started = []
        # A run needs seconds to stop: tried where every command is.
        for command, usual in services(self.port + 4) + (STOPPED if self.everything else ()):
            folder = self.fresh_folder()
            started.append((command, usual, folder, set(os.listdir(folder)), self.start(command, folder)))
        shares = self.lowest_shares([process for *_, process in started])
        for *_, process in started:
            process.terminate()
        for (command, usual, folder, before, process), share in zip(started, shares):
            name = " ".join(command[:2]) if command[0] == "legopt" else command[0]
            if share >= IDLE_SHARE:
                self.fault(name, f"{share:.0%} of a core with nothing to do")
            self.judge_service(name, usual, process)
            for left in sorted(set(os.listdir(folder)) - before):
                if left.endswith(".lock"):
                    self.fault(name, f"leaves {left}")

    def judge_service(self, name, usual, process):
        try:
            message = process.communicate(timeout=END_S)[0].decode("utf-8", "replace")
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            self.fault(name, f"still runs {END_S} s after SIGTERM")
            return
        self.judge_end(name, process.returncode, message, usual)

    def run(self):
        folder = self.fresh_folder()
        for command in self.bench.commands:
            if command.on_path and "PATH" not in self.surrounding.variables(self.bench.environment()):
                continue
            of_sizes = self.surrounding.name.startswith("file_size_") and command.writes
            if self.everything or command.often or of_sizes:
                self.try_command(command, folder)
        if self.surrounding.services:
            self.try_services()
        return self.faults


class Bench:
    """Data shared by all trials: programs, a folder with their inputs, usual exit codes."""

    def __init__(self, build):
        self.build = build
        self.scratch = tempfile.mkdtemp(prefix="legopt-environment-")
        os.chmod(self.scratch, 0o755)
        self.documented = documented_codes()
        dataset = os.path.realpath(os.path.join(build, "legopt-data", "garage-small"))
        self.commands = commands(dataset)
        self.usual = {}
        self.template = os.path.join(self.scratch, "template")
        os.mkdir(self.template)
        shutil.copytree(dataset, os.path.join(self.template, COPY))
        self.write("s.yaml", SUITE.format(dataset=dataset))
        self.write("long.yaml", LONG_SUITE.format(dataset=dataset))
        self.write("pool.yaml", POOL)
        self.write("solver.json", '{"name": "silent", "command": ["/bin/true"]}\n')
        self.write("sleeper.json", '{"name": "sleeper", "command": ["/bin/sleep", "1000"]}\n')
        self.played = os.path.join(self.scratch, "bin")
        os.mkdir(self.played)
        for name, body in PLAYED.items():
            program = os.path.join(self.played, name)
            with open(program, "w", encoding="utf-8") as file:
                file.write(f"#!/bin/sh\n{body}\n")
            os.chmod(program, 0o755)
        self.legopt("run", "s.yaml", "--db", "small.sqlite", "--workers", "1")
        self.legopt("export", "1", "--db", "small.sqlite", "--dataset", dataset, "--out", "given.json")
        self.legopt("archive", "pack", "1", "--db", "small.sqlite", "--out", "given.legopt-archive")
        self.server = self.start_server()

    def write(self, name, text):
        with open(os.path.join(self.template, name), "w", encoding="utf-8") as file:
            file.write(text)

    def start_server(self):
        """A server that the file ACCESS names, with an experiment that no worker runs."""
        served = os.path.join(self.scratch, "lab.sqlite")
        command = [os.path.join(self.build, "legopt-server"), "--db", served, "--port", "17680", "--listen", "127.0.0.1:17682",
                   "--access", os.path.join(self.template, ACCESS)]
        server = subprocess.Popen(command, cwd=self.scratch, env=self.environment(), stdout=subprocess.DEVNULL)
        self.legopt("submit", "s.yaml", "--port", "17680", "--timeout", "30")
        return server

    def environment(self):
        return {"PATH": self.played + ":" + os.environ.get("PATH", ""), "HOME": self.scratch, "LEGOPT_PORT": "17667", "LC_ALL": "C"}

    def legopt(self, *arguments):
        subprocess.run([os.path.join(self.build, "legopt"), *arguments], cwd=self.template, env=self.environment(), check=True,
                       stdout=subprocess.DEVNULL, timeout=PATIENCE_S)

    def remove(self):
        self.server.terminate()
        self.server.wait(END_S)
        shutil.rmtree(self.scratch, ignore_errors=True)


def chosen(group, clock_library):
    candidates = surroundings.all_surroundings(clock_library) + [NoRoute("no_route")]
    return [each for each in candidates if each.name.startswith(GROUPS[group])]


def in_own_network():
    """Restarts this script in a network namespace; returns false if that is not permitted."""
    if os.environ.get("LEGOPT_ENVIRONMENT_TEST") == "inside":
        return True
    script = 'ip link set lo up && ip route add 239.255.76.67/32 dev lo && exec "$@"'
    if subprocess.run(["unshare", "-n", "sh", "-c", script, "sh", "true"], capture_output=True).returncode != 0:
        return False
    os.environ["LEGOPT_ENVIRONMENT_TEST"] = "inside"
    os.execvp("unshare", ["unshare", "-n", "sh", "-c", script, "sh", sys.executable, "-B", *sys.argv])


def try_surrounding(bench, surrounding, everything, port):
    """Returns the faults; None if it was skipped."""
    if surrounding.needs_root and os.geteuid() != 0:
        print(f"{surrounding.name}: skipped, needs root")
        return None
    # One environment of each family tries every command.
    whole = everything or surrounding.name in WHOLE or not surrounding.name.startswith(FAMILIES)
    begin = time.monotonic()
    faults = Trial(bench, surrounding, whole, port).run()
    print("\n  ".join([f"{surrounding.name}: {len(faults)} faults, {time.monotonic() - begin:.1f} s", *faults]), flush=True)
    return faults


INHERITED = []  # the bench, in processes of the pool


def inherit(bench):
    INHERITED.append(bench)


def try_in_process(*arguments):
    return try_surrounding(INHERITED[0], *arguments)


def main():
    everything = "--all" in sys.argv
    build, group, *rest = [word for word in sys.argv[1:] if word != "--all"]
    if not in_own_network():
        print("SKIPPED: no network namespaces here (root is needed)")
        return SKIPPED
    bench = Bench(os.path.abspath(build))
    try:
        usual, *others = chosen(group, rest[0] if rest else None)
        assert usual.name == "usual"  # the others are compared with it
        found = [try_surrounding(bench, usual, everything, FIRST_PORT)]
        # Processes rather than threads, since each changes its own state before it starts a program.
        with multiprocessing.get_context("fork").Pool(AT_ONCE, initializer=inherit, initargs=(bench,)) as pool:
            ports = range(FIRST_PORT + 8, FIRST_PORT + 8 * (len(others) + 1), 8)
            tasks = [(other, everything, port) for other, port in zip(others, ports)]
            found += pool.starmap(try_in_process, tasks, chunksize=1)
    finally:
        bench.remove()
    faults = sum(len(each) for each in found if each is not None)
    tried = sum(1 for each in found if each is not None)
    print(f"{tried} surroundings, {faults} faults")
    return 1 if faults or tried < 2 else 0


FAMILIES = ("closed", "file_size", "descriptors", "memory", "processes", "ignored", "home_is", "clock")
WHOLE = ("usual", "closed_012", "descriptors_20", "descriptors_soft_64", "memory_300_MiB", "ignored_all", "file_size_16_KiB",
         "processes_0", "clock_of_2099")

if __name__ == "__main__":
    sys.exit(main())
