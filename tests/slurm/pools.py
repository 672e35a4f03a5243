"""Pools with a permanent server, by Slurm and through ssh; datasets that are missing on nodes."""
import contextlib
import json
import signal
import subprocess
import time

import cluster as engine
import large_dataset
import remote_hosts
from runs import PROGRAMS, SHORT, SOURCE, LongRun, check_nothing_left, expect, rows

LISTEN = f"{engine.CONTROLLER_ADDRESS}:7669"
SHORT_POOL = "worker: {drain_s: 5, idle_timeout_s: 60, wait_server_s: 20}\n"


class Service:
    """A permanent server, with its key, and the commands of its users."""

    def __init__(self, folder):
        self.folder = folder
        self.database = folder / "service.sqlite"
        self.key = folder / "key"
        self.access = folder / "access"
        engine.run(PROGRAMS / "legopt", "service", "keygen", self.key)
        with open(folder / "server.log", "wb") as log:
            self._server = subprocess.Popen(
                [PROGRAMS / "legopt-server", "--db", self.database, "--key-file", self.key, "--listen", LISTEN,
                 "--access", self.access], stdout=log, stderr=log)
        engine.wait_for("the access file", self.access.exists)

    def legopt(self, *words, **options):
        return engine.run(PROGRAMS / "legopt", *words, cwd=self.folder, **options)

    def stop(self):
        self._server.terminate()
        expect(self._server.wait(20) == 0, (self.folder / "server.log").read_text())

    def online(self):
        status = json.loads(self.legopt("status", "--format", "json", "--key-file", self.key).stdout)
        return sum(worker["online"] for worker in status["workers"])

    def work(self):
        """Submits an experiment, waits for its end, and returns the workers involved."""
        (self.folder / "short.yaml").write_text(SHORT, encoding="utf-8")
        self.legopt("submit", "short.yaml", "--wait", "--again", "--key-file", self.key, timeout=60)
        return {row[0] for row in rows(self.database, "SELECT hostname FROM result_origins WHERE experiment_id ="
                                       " (SELECT max(experiment_id) FROM experiments)")}


@contextlib.contextmanager
def service(folder):
    made = Service(folder)
    try:
        yield made
    finally:
        made.stop()


def slurm_pool(cluster, folder):
    """Policy: workers of a pool serve every experiment until 'pool stop', which ends all of them. No node contains the
    key or the access file."""
    (folder / "pool.yaml").write_text("slurm: {nodes: 2, output: /tmp/%A_%a.log}\n" + SHORT_POOL, encoding="utf-8")
    with service(folder) as site:
        flags = ("pool.yaml", "--access", site.access, "--key-file", site.key, "--folder", "pool")
        script = site.legopt("pool", "slurm", *flags, "--dry-run").stdout
        expect("#SBATCH --array=0-1\n" in script and "(the key)" in script, script)
        expect(site.key.read_text().strip() not in script, "the key is printed")
        site.legopt("pool", "slurm", *flags)
        engine.wait_for("both in 'pool status'", lambda: states(site) == {"RUNNING": 2})
        hosts = site.work()
        expect(hosts <= set(engine.NODES) and hosts, f"who worked: {hosts}")
        site.legopt("pool", "stop", "pool")
        check_nothing_left(cluster)
        expect(states(site) == {}, states(site))
        expect(rows(site.database, "SELECT count(*) FROM jobs WHERE state <> 'done'") == [(0,)], "jobs are left")
        return f"{sorted(hosts)} worked; stopped, nothing left"


def states(site, folder="pool"):
    lines = site.legopt("pool", "status", folder, "--format", "csv", check=False).stdout.splitlines()[1:]
    found = {}
    for line in lines:
        state = line.split(",")[1]
        found[state] = found.get(state, 0) + 1
    return found


def ssh_pool(cluster, folder):
    """Policy: through ssh a worker lives as long as its connection. It ends with 'pool stop' or with the death of its
    keeper, and no host keeps a worker. An unreachable host is named, and does not stop the others."""
    with remote_hosts.daemons(cluster, folder) as client_options, service(folder) as site:
        names = [node.address for node in cluster.nodes]
        hosts = folder / "lab.hosts"
        hosts.write_text("# the lab\n" + "\n".join(names) + "\n10.77.0.99  # switched off\n", encoding="utf-8")
        options = ", ".join(f"{key}: {value}" for key, value in client_options.items())
        (folder / "pool.yaml").write_text(f"ssh: {{hosts_file: lab.hosts, ConnectTimeout: 3, {options}}}\n" + SHORT_POOL,
                                          encoding="utf-8")
        keeper = keep(site)
        engine.wait_for("both workers", lambda: states(site) == {"connected": 2, "no connection": 1}, 20)
        engine.wait_for("both at the server", lambda: site.online() == 2)
        worked = site.work()
        expect(worked and worked <= set(engine.NODES), f"who worked: {worked}")
        site.legopt("pool", "stop", "pool")
        _, errors = keeper.communicate(timeout=20)
        expect(keeper.returncode == 14 and "10.77.0.99: no connection" in errors, f"{keeper.returncode}: {errors}")
        nobody_works(cluster)

        keeper = keep(site)
        engine.wait_for("both workers again", lambda: all(node.processes("legopt-worker") for node in cluster.nodes), 20)
        keeper.send_signal(signal.SIGKILL)
        keeper.communicate(timeout=20)
        began = time.monotonic()
        nobody_works(cluster)
        return f"{sorted(worked)} worked; after the keeper's death all were gone in {time.monotonic() - began:.1f} s"


def keep(site):
    return subprocess.Popen([PROGRAMS / "legopt", "pool", "ssh", "pool.yaml", "--access", site.access, "--key-file", site.key,
                             "--folder", "pool"], cwd=site.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def nobody_works(cluster):
    for node in cluster.nodes:
        engine.wait_for(f"{node.name} without workers", lambda node=node: not node.processes("legopt-worker"))


def large_dataset_to_bare_nodes(cluster, folder):
    """Policy: nodes without a dataset get it from the server, once; files in their caches are used only after
    their hashes have been verified."""
    dataset = folder / "large"
    large_dataset.make(SOURCE / "data" / "garage-small", dataset)
    engine.run(PROGRAMS / "legopt", "dataset", "hash", dataset)
    first = travels(cluster, folder / "first", dataset)
    expect(set(first) == set(engine.NODES), f"who asked the server: {first}")
    victim = cluster.nodes[0]
    cached = victim.run("sh", "-c", "ls -d ~/.cache/legopt/datasets/*").stdout.split()
    expect(len(cached) == 1, cached)
    victim.run("sh", "-c", f"printf x | dd of={cached[0]}/rock.obj bs=1 seek=1000000 conv=notrunc")
    second = travels(cluster, folder / "second", dataset)
    expect(set(second) == {victim.name}, f"who asked the server again: {second}")
    return f"{large_dataset.PACKED_BYTES // 1_000_000} MB to two nodes; again to the one where a byte was changed"


def travels(cluster, folder, dataset):
    """Returns the hosts on which a worker reports that the dataset came from the server. Both have it once they solve
    its jobs. There are enough jobs that a worker with the dataset leaves some to the one that has to fetch it."""
    folder.mkdir()
    run = LongRun(folder, f"slurm: {{nodes: 2, output: /tmp/{folder.name}-%a.log}}\n" + SHORT_POOL,
                  arguments=("--dataset", dataset), patience_s=90)
    run.stop()
    check_nothing_left(cluster)
    said = {node.name: node.run("sh", "-c", f"cat /tmp/{folder.name}-*.log").stdout for node in cluster.nodes}
    return [name for name, text in said.items() if "came from the server" in text]


SCENARIOS = (slurm_pool, ssh_pool, large_dataset_to_bare_nodes)
