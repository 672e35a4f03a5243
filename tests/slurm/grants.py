"""Workers that are granted a part of a node, and workers that share a node."""
import contextlib
import os
import pathlib

from runs import POOL, PROGRAMS, LongRun, Run, ShortRun, check_bits, check_nothing_left, expect, server_status


def job_processes(node):
    """Returns the processors that each job process of a node may use."""
    parents = {}
    masks = {}
    for process in node.processes("legopt-worker"):
        with contextlib.suppress(OSError):  # the process may have ended
            if "\0--child\0" in pathlib.Path(f"/proc/{process}/cmdline").read_text(encoding="utf-8"):
                status = pathlib.Path(f"/proc/{process}/status").read_text(encoding="utf-8")
                parents[process] = int(status.split("\nPPid:")[1].split()[0])
                masks[process] = tuple(sorted(os.sched_getaffinity(process)))
    # A job process reads files in forked copies of itself.
    return sorted(mask for process, mask in masks.items() if parents[process] not in masks)


def part_of_a_node(cluster, folder):
    """Policy: a worker that is granted one processor of two has one slot, and its job stays there."""
    run = LongRun(folder, POOL.replace("nodes: 2", "nodes: 1, exclusive: false, cpus-per-task: 1"), workers=1)
    expect(run.rows("SELECT slots, processors FROM workers") == [(1, 1)], run.rows("SELECT * FROM workers"))
    masks = [mask for node in cluster.nodes for mask in job_processes(node)]
    run.stop()
    expect(len(masks) == 1 and len(masks[0]) == 1, f"job processes on {masks}")
    check_nothing_left(cluster)
    return f"-c 1: one slot on processor {masks[0][0]}"


def whole_node(cluster, folder):
    """Policy: slots that fill a node have one distinct core each."""
    processors = os.cpu_count()
    pool = POOL.replace("nodes: 2", f"nodes: 1, cpus-per-task: {processors}, hint: nomultithread")
    run = LongRun(folder, pool, workers=1)
    slots = run.rows("SELECT slots FROM workers")[0][0]
    masks = [mask for node in cluster.nodes for mask in job_processes(node)]
    run.stop()
    expect(len(masks) == slots, f"{slots} slots, job processes on {masks}")
    expect(all(len(mask) == 1 for mask in masks) and len(set(masks)) == slots, f"job processes on {masks}")
    check_nothing_left(cluster)
    return f"-c {processors} --hint=nomultithread: {slots} slots on {masks}"


def two_pools_on_a_node(cluster, folder):
    """Policy: two users with the same files, at the same time on the same nodes, do not affect each other: their
    workers do not even receive each other's frames."""
    pool = POOL.replace("nodes: 2", "nodes: 1, exclusive: false, cpus-per-task: 1")
    for name in ("first", "second"):
        (folder / name).mkdir()
    runs = [LongRun(folder / "first", pool, workers=1), ShortRun(folder / "second", pool)]
    status, _ = runs[1].end()
    expect(status == 0, runs[1].errors())
    hosts = [run.rows("SELECT hostname FROM workers") for run in runs]
    expect(hosts[0] == hosts[1] and len(hosts[0]) == 1, f"workers on {hosts}")
    rejected = server_status(runs[0])["server"]["transport"]
    foreign = {name: count for name, count in rejected.items() if name.startswith("rejected") and count}
    runs[0].stop()
    runs[0].check_uncharged()
    expect(not foreign, f"frames of others were heard: {foreign}")
    check_nothing_left(cluster)
    return f"both on {hosts[0][0][0]}, no frame crossed"


def masked_processor(cluster, folder):
    """Policy: a node whose processor appears to have fewer features gives the same bits, and has the same build id."""
    masked = cluster.shared / "masked-worker"
    masked.write_text("#!/bin/sh\nexport GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-AVX512F,-ERMS\n"
                      f'exec "{PROGRAMS}/legopt-worker" "$@"\n', encoding="utf-8")
    masked.chmod(0o755)
    run = Run(folder, "quick", POOL.replace("nodes: 2", "nodes: 1").replace("worker: {", f"worker: {{program: {masked}, "))
    status, _ = run.end()
    expect(status == 0, run.errors())
    check_bits(run)
    check_nothing_left(cluster)
    return "550 jobs, the same bits"


SCENARIOS = (part_of_a_node, whole_node, two_pools_on_a_node, masked_processor)
