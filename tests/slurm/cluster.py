"""A Slurm cluster on one machine: munged, slurmctld and a slurmd for each node, the real programs of Debian. Every node
has its own network, host name, /tmp and ~/.cache. The networks meet in a switch in the controller's network, and
multicast stays within each. Must be used in namespaces made by enter(): when the caller ends, all its child processes
end."""
import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import time

NODES = ("n1", "n2")
CONTROLLER_ADDRESS = "10.77.0.1"
PROGRAMS = {"slurmctld": "slurmctld", "slurmd": "slurmd", "sbatch": "slurm-client", "munged": "munge", "ip": "iproute2",
            "sshd": "openssh-server", "ssh": "openssh-client"}
INSIDE = "LEGOPT_TEST_INSIDE_NAMESPACES"
SKIPPED = 77


def skip(reason):
    print(f"NOT TESTED UNDER A REAL SLURM: {reason}", file=sys.stderr)
    sys.exit(1 if os.environ.get("CI") == "true" and "refused" not in reason else SKIPPED)


def enter():
    """Restarts this program in new namespaces; exits with 77 and a message if that is not possible."""
    if os.environ.get(INSIDE):
        return
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    missing = sorted({package for program, package in PROGRAMS.items() if not shutil.which(program)})
    if missing:
        skip(f"missing: scripts/install-deps --only {' '.join(missing)}")
    if os.geteuid() != 0:
        skip("refused to all but root, who alone may start jobs of others")
    unshare = ["unshare", "--net", "--mount", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if subprocess.run([*unshare, "true"], capture_output=True).returncode != 0:
        skip(f"'{' '.join(unshare)}' is refused here")
    os.environ[INSIDE] = "1"
    os.execvp(unshare[0], [*unshare, sys.executable, "-B", *sys.argv])


def run(*command, check=True, **options):
    options.setdefault("timeout", 60)
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if check and result.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))} ended with {result.returncode}: {result.stdout}{result.stderr}")
    return result


def wait_for(what, condition, timeout_s=30.0):
    """Polls `condition` and returns its first true value."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.1)
    raise AssertionError(f"waited {timeout_s:.0f} s in vain for {what}")


class Node:
    """A host: processes in separate namespaces."""

    def __init__(self, name, address, folder):
        self.name, self.address, self.daemon = name, address, None
        self._spool = folder / name
        self._spool.mkdir()
        self._holder = subprocess.Popen(["unshare", "--net", "--mount", "--uts", "sleep", "infinity"])
        mine = os.readlink("/proc/self/ns/uts")
        wait_for("a node's namespaces", lambda: os.readlink(f"/proc/{self._holder.pid}/ns/uts") != mine)
        run("ip", "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", self._holder.pid)
        run("ip", "link", "set", name, "master", "switch", "up")
        self.run("hostname", name)
        cache = pathlib.Path.home() / ".cache"
        cache.mkdir(exist_ok=True)
        for folder_of_its_own in ("/tmp", cache):
            self.run("mount", "-t", "tmpfs", "tmpfs", folder_of_its_own)
        self.run("ip", "address", "add", f"{address}/24", "dev", "eth0")
        for device in ("lo", "eth0"):
            self.run("ip", "link", "set", device, "up")
        self.run("ip", "route", "add", "224.0.0.0/4", "dev", "lo")

    def inside(self, command):
        return ["nsenter", "-t", str(self._holder.pid), "-n", "-m", "-u", *map(str, command)]

    def run(self, *command, **options):
        return run(*self.inside(command), **options)

    def start(self):
        with open(self._spool / "daemon.log", "ab") as log:
            command = self.inside([shutil.which("slurmd"), "-D", "-N", self.name])
            self.daemon = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)

    def kill(self):
        self.daemon.kill()
        self.daemon.wait()

    def cut(self):
        """Disconnects the node from the network."""
        run("ip", "link", "set", self.name, "down")

    def join(self):
        run("ip", "link", "set", self.name, "up")

    def processes(self, program):
        """Returns the ids of this node's processes that run `program`."""
        space = os.readlink(f"/proc/{self._holder.pid}/ns/uts")
        found = []
        for entry in filter(str.isdigit, os.listdir("/proc")):
            with contextlib.suppress(OSError):
                name = os.path.basename(os.readlink(f"/proc/{entry}/exe")).removesuffix("-wlm")  # Debian's names
                if os.readlink(f"/proc/{entry}/ns/uts") == space and name == program:
                    found.append(int(entry))
        return found


class Cluster:
    """A cluster that runs from its construction."""

    def __init__(self):
        run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/run")  # shared by all nodes, like a site's /etc/slurm
        self._folder = pathlib.Path("/run/slurm")
        self._folder.mkdir()
        self._processors = os.cpu_count()
        run("hostname", "controller")
        for command in ("link set lo up", "link add switch type bridge", f"address add {CONTROLLER_ADDRESS}/24 dev switch",
                        "link set switch up", "route add 224.0.0.0/4 dev lo"):
            run("ip", *command.split())
        os.environ["SLURM_CONF"] = str(self._folder / "slurm.conf")
        self._start_munge()
        self._write_configuration()
        self.nodes = [Node(name, f"10.77.0.{11 + i}", self._folder) for i, name in enumerate(NODES)]
        self.controller = None
        self.start_controller()
        for node in self.nodes:
            node.start()
        wait_for("idle nodes", lambda: self.states() == ["idle"] * len(NODES))

    def _start_munge(self):
        # It requires folders that only root can write, and one that everybody can reach.
        folder = self._folder / "munge"
        folder.mkdir(mode=0o755)
        key = folder / "key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(128))
        options = {"socket": self._socket, "key-file": key, "pid-file": folder / "pid", "log-file": folder / "log",
                   "seed-file": folder / "seed"}
        run("munged", "--force", *(f"--{name}={value}" for name, value in options.items()))

    @property
    def _socket(self):
        return self._folder / "munge" / "socket"

    def _write_configuration(self):
        folder = self._folder
        for name in ("state", "mail"):
            (folder / name).mkdir()
        hosts = "\n".join(f"NodeName={name} NodeAddr=10.77.0.{11 + i} NodeHostname={name} CPUs={self._processors}"
                          " RealMemory=2000 State=UNKNOWN" for i, name in enumerate(NODES))
        nodes = ",".join(NODES)
        (folder / "slurm.conf").write_text(f"""\
ClusterName=test
SlurmctldHost=controller({CONTROLLER_ADDRESS})
SlurmUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={self._socket}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n/slurmd.pid
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/affinity
JobAcctGatherType=jobacct_gather/none
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
SlurmdTimeout=10
SlurmctldTimeout=10
KillWait=10
ReturnToService=2
{hosts}
PartitionName=work Nodes={nodes} Default=YES PriorityTier=1 GraceTime=10 MaxTime=60 State=UP
PartitionName=urgent Nodes={nodes} PriorityTier=10 PreemptMode=OFF MaxTime=60 State=UP
""", encoding="utf-8")

    @property
    def shared(self):
        """Returns a folder that all nodes share."""
        return self._folder

    def start_controller(self):
        with open(self._folder / "slurmctld.log", "ab") as log:
            self.controller = subprocess.Popen([shutil.which("slurmctld"), "-D"], stdout=log, stderr=log,
                                               stdin=subprocess.DEVNULL)

    def wait_until_saved(self):
        """Waits until the controller has saved the running jobs; unsaved ones are lost when it is killed."""
        now = time.time()
        for job in {row[0] for row in self.jobs()}:  # it saves changed jobs, which may have happened before now
            run("scontrol", "update", f"jobid={job}", "comment=saved")
        wait_for("the controller's state on disk", lambda: (self._folder / "state/job_state").stat().st_mtime > now, 60)

    def states(self):
        result = run("sinfo", "--noheader", "--Node", "--partition=work", "--format=%t", check=False, timeout=30)
        return result.stdout.split()

    def jobs(self, *options):
        """Returns rows of job id, state, node or reason, and restarts."""
        result = run("squeue", "--noheader", "--array", "--format=%i|%T|%R|%o", *options, check=False, timeout=30)
        return [line.split("|") for line in result.stdout.splitlines()]

    def job(self, job_id):
        """Returns the controller's information about a job, including ended array elements, as a dict."""
        text = run("scontrol", "--oneliner", "show", "job", job_id, check=False).stdout
        return [dict(word.split("=", 1) for word in line.split() if "=" in word) for line in text.splitlines()]

    def logs(self):
        return "\n".join(f"--- {path.name}\n" + "\n".join(path.read_text(errors="replace").splitlines()[-30:])
                         for path in [self._folder / "slurmctld.log", *self._folder.glob("*/daemon.log")] if path.exists())
