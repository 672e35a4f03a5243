"""legopt under a real Slurm: slurmctld and two nodes on this machine, without multicast between them and without a
shared folder.

    slurm_test.py FOLDER_OF_PROGRAMS [--brief | SCENARIO...]    # default: all, six minutes

--brief, as CTest runs it, omits the longest scenarios: Slurm's own delays, and cases that other tests cover as well.
Exits with 77 and a message if a cluster cannot be made (cluster.py reports the reason)."""
import pathlib
import sys
import tempfile
import time

import cluster as engine
import disturbances
import documents
import grants
import pools
import refusals
from runs import POOL, Run, check_bits, check_nothing_left, expect


def note(text):
    print(f"{time.monotonic() - START:6.1f} s  {text}", flush=True)


def same_bits_on_both_nodes(cluster, folder):
    """Policy: two nodes without a common network and without this machine's files give the table of one machine, bit
    by bit."""
    run = Run(folder, "quick", POOL)
    status, _ = run.end()
    expect(status == 0, run.errors())
    check_bits(run)
    job = (folder / "run.sqlite.pool" / "jobs").read_text(encoding="ascii").split()[-1]
    hosts = dict(run.rows("SELECT hostname, count(*) FROM attempts JOIN workers USING (worker_id)"
                          " WHERE outcome = 'finished' GROUP BY 1"))
    expect(set(hosts) == set(engine.NODES), f"who worked: {hosts}")
    began = min(started(cluster, element) for element in (f"{job}_0", f"{job}_1"))
    first_s = run.rows("SELECT min(ended_at_us) FROM attempts WHERE outcome = 'finished'")[0][0] / 1e6 - began
    check_nothing_left(cluster)
    return f"550 jobs, on {hosts}; the first result {first_s:.1f} s (+- 0.5) after the array's start"


def started(cluster, element):
    """Returns the time at which Slurm started a worker, to a second."""
    return time.mktime(time.strptime(cluster.job(element)[0]["StartTime"], "%Y-%m-%dT%H:%M:%S")) + 0.5


LEFT_OUT_IN_BRIEF = ("time_limit", "preempted", "link_cut", "step_killed", "masked_processor", "large_dataset_to_bare_nodes", "unreachable")
SCENARIOS = (same_bits_on_both_nodes, *disturbances.SCENARIOS, *grants.SCENARIOS, *pools.SCENARIOS, *refusals.SCENARIOS, *documents.SCENARIOS)


def main():
    engine.enter()
    names = [scenario.__name__ for scenario in SCENARIOS]
    asked = sys.argv[2:] or names
    if asked == ["--brief"]:
        asked = [name for name in names if name not in LEFT_OUT_IN_BRIEF]
    unknown = {*asked, *LEFT_OUT_IN_BRIEF}.difference(names)
    if unknown:
        sys.exit(f"slurm_test: no scenario {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    chosen = [scenario for scenario in SCENARIOS if scenario.__name__ in asked]
    cluster = engine.Cluster()
    note(f"{engine.run('sinfo', '--version').stdout.strip()}: {len(cluster.nodes)} nodes are idle")
    for scenario in chosen:
        with tempfile.TemporaryDirectory(prefix="legopt-slurm-") as folder:
            try:
                result = scenario(cluster, pathlib.Path(folder))
            except Exception:
                note(f"FAILED: {scenario.__name__}")
                print(cluster.logs(), file=sys.stderr)
                for node in cluster.nodes:
                    print(node.run("sh", "-c", "tail -n 20 /tmp/*.log", check=False).stdout, file=sys.stderr)
                raise
        note(f"{scenario.__name__}: {result}")


START = time.monotonic()
if __name__ == "__main__":
    main()
