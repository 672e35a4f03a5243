"""Impossible pools: each is reported with the file, the field and a remedy, and has its own exit code."""
import os
import time

import cluster as engine
from runs import PROGRAMS, REFUSED, UNREACHABLE, ShortRun, check_nothing_left, expect

UNUSABLE = 2


def said(folder, name, pool, status, *words, environment=None):
    """Returns the error of a 'legopt run --slurm' that cannot start."""
    (folder / name).mkdir()
    run = ShortRun(folder / name, pool, environment)
    began = time.monotonic()
    code, _ = run.end(60)
    text = run.errors()
    expect(code == status, f"{name}: exit code {code}, expected {status}: {text}")
    for word in words:
        expect(word in text, f"{name}: no '{word}' in: {text}")
    return time.monotonic() - began


def refused_by_us_or_slurm(cluster, folder):
    """Policy: a pool that cannot be submitted is reported at once."""
    said(folder, "partition", "slurm:\n  nodes: 1\n  partition: nowhere\n", REFUSED, "pool.yaml:3", "slurm.partition", "nowhere",
         "invalid partition")
    said(folder, "option", "slurm: {nodes: 1, partitoin: work}\n", REFUSED, "pool.yaml:1", "slurm.partitoin", "Slurm says")
    said(folder, "word", "slurm: {node: 2}\n", UNUSABLE, "pool.yaml:1", "slurm.node", "nodes")
    said(folder, "section", "slurn: {nodes: 2}\n", UNUSABLE, "pool.yaml:1", "slurn", "did you mean 'slurm'")
    said(folder, "array", "slurm: {nodes: 1, array: 0-3}\n", UNUSABLE, "slurm.array", "say 'nodes'")
    bare = {**os.environ, "PATH": "/nowhere"}
    said(folder, "without-slurm", "slurm: {nodes: 2}\n", 71, "sbatch is not on PATH", environment=bare)
    check_nothing_left(cluster)
    return "partition, options, unknown words, no sbatch"


def unreachable(cluster, folder):
    """Policy: if no node reaches the server, the run ends and reports the tried addresses, or that the key may be
    wrong."""
    pool = "slurm: {nodes: 2, output: /tmp/%A_%a.log}\nworker: {wait_server_s: 3"
    alone = said(folder, "address", pool + "}\nserver: {listen: '127.0.0.1:7675'}\n", UNREACHABLE, "127.0.0.1:7675",
                 "server.listen", "pool.yaml")
    other = cluster.shared / "other-key"
    engine.run(PROGRAMS / "legopt", "service", "keygen", other)
    keyed = said(folder, "key", pool + f", key_file: {other}}}\n", UNREACHABLE, engine.CONTROLLER_ADDRESS,
                 "worker.key_file", str(other))
    check_nothing_left(cluster)
    return f"an address that only the server reaches: {alone:.0f} s; another key: {keyed:.0f} s"


SCENARIOS = (refused_by_us_or_slurm, unreachable)
