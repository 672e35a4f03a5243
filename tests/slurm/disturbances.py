"""Disturbances of workers on a cluster and their cost: no acknowledged result is lost, and otherwise at most one
attempt of the jobs that ran on a lost machine."""
import contextlib
import os
import signal
import time

import cluster as engine
from runs import CHARGES, POOL, LongRun, check_nothing_left, expect, server_of, server_status


def seconds_until(what, condition, timeout_s):
    began = time.monotonic()
    engine.wait_for(what, condition, timeout_s)
    return time.monotonic() - began


def element_on(cluster, node):
    return next(row[0] for row in cluster.jobs() if row[2] == node.name and row[1] == "RUNNING")


def come_back(cluster, run, element, node):
    """Makes a job that Slurm has re-queued start soon, instead of after Slurm's delay of two minutes."""
    engine.wait_for("the element to be queued again", lambda: cluster.job(element)[0]["JobState"] == "PENDING", 40)
    run.check_uncharged()
    engine.run("scontrol", "update", f"jobid={element}", "StartTime=now+5seconds")  # slurmd refuses an earlier time
    engine.wait_for("the worker's return", lambda: run.at_work().get(node.name, "").endswith(".1"), 40)


def cancelled(cluster, folder):
    """Policy: scancel of one element costs no job an attempt. The same holds for the end of the run, which leaves
    nothing behind."""
    run = LongRun(folder)
    victim = cluster.nodes[0]
    engine.run("scancel", element_on(cluster, victim))
    gone_s = seconds_until("the worker's end", lambda: not victim.processes("legopt-worker"), 15)
    engine.wait_for("its jobs' return", lambda: victim.name not in run.at_work())
    expect(run.at_work(), "the other worker stopped, too")
    began = time.monotonic()
    run.stop()
    run.check_uncharged()
    check_nothing_left(cluster)
    return f"gone in {gone_s:.1f} s; the run's end took {time.monotonic() - began:.1f} s"


def time_limit(cluster, folder):
    """Policy: before the time limit the worker drains, releases jobs that do not end in time, and is queued again."""
    # With a limit of one minute, Slurm's warning, due 65 to 125 s before the end, might arrive before the script can
    # receive it.
    run = LongRun(folder, POOL.replace("slurm: {", "slurm: {time: 2, at_once: 1, ").replace("nodes: 2", "nodes: 1"), workers=1)
    host = next(iter(run.at_work()))
    node = next(node for node in cluster.nodes if node.name == host)
    element = element_on(cluster, node)
    told_s = seconds_until("the signal", lambda: not node.processes("legopt-worker"), 75)
    come_back(cluster, run, element, node)
    run.stop()
    run.check_uncharged()
    check_nothing_left(cluster)
    return f"told after {told_s:.0f} s, drained, queued again, back as {element}.1"


def preempted(cluster, folder):
    """Policy: a preempting job gets the node within the grace time of the partition, and the worker returns later."""
    run = LongRun(folder)
    node = cluster.nodes[1]
    element = element_on(cluster, node)
    rival = engine.run("sbatch", "--parsable", "--partition=urgent", "--exclusive", f"--nodelist={node.name}",
                       "--output=/dev/null", "--wrap=sleep 3").stdout.strip()
    gone_s = seconds_until("the worker to give way", lambda: not node.processes("legopt-worker"), 60)
    engine.wait_for("the rival's end", lambda: cluster.job(rival)[0]["JobState"] == "COMPLETED", 60)
    come_back(cluster, run, element, node)
    run.stop()
    run.check_uncharged()
    check_nothing_left(cluster)
    return f"gave way {gone_s:.0f} s after the rival's submission, back as {element}.1"


def daemons_killed(cluster, folder):
    """Policy: a crash and restart of slurmd and slurmctld does not affect workers."""
    run = LongRun(folder)
    workers, leases = online(run), engine.wait_for("running attempts", run.leases)
    cluster.wait_until_saved()
    cluster.nodes[0].kill()
    cluster.controller.kill()
    cluster.controller.wait()
    time.sleep(3)
    cluster.start_controller()
    cluster.nodes[0].start()
    engine.wait_for("Slurm's return", lambda: sorted(row[1] for row in cluster.jobs()) == ["RUNNING"] * 2, 30)
    engine.wait_for("the same workers", lambda: online(run) == workers, 15)
    run.check_kept(leases)
    run.check_uncharged()
    run.stop()
    run.check_uncharged()
    check_nothing_left(cluster)
    return "the same workers before and after"


def link_cut(cluster, folder):
    """Policy: jobs of an unreachable node are re-leased to others when their leases end, long before Slurm notices.
    Results that the lost worker finishes meanwhile are not counted twice."""
    run = LongRun(folder)
    node = cluster.nodes[1]
    lost = run.rows("SELECT job_id, attempt FROM attempts JOIN workers USING (worker_id)"
                    " WHERE outcome = 'running' AND hostname = ?", node.name)
    node.cut()
    leased_s = seconds_until("the leases' end", lambda: node.name not in run.at_work(), 20)
    expect(leased_s < 13, f"{leased_s:.1f} s")
    slurm_says = {row[2]: row[1] for row in cluster.jobs()}.get(node.name)
    engine.wait_for("the lost worker to stop solving", lambda: not solving(node), 30)
    node.join()
    run.stop()
    outcomes = {run.rows("SELECT outcome FROM attempts WHERE job_id = ? AND attempt = ?", *row)[0][0] for row in lost}
    expect(outcomes <= {"expired", "finished"}, outcomes)
    charged = run.rows("SELECT count(*) FROM attempts WHERE outcome NOT IN ('finished', 'returned')")[0][0]
    expect(charged <= len(lost), f"{charged} attempts charged, {len(lost)} jobs ran there")
    engine.run("scancel", "--user=root")
    engine.wait_for("all nodes", lambda: cluster.states() == ["idle"] * 2, 60)
    check_nothing_left(cluster)
    return f"jobs leased anew after {leased_s:.1f} s, when Slurm said {slurm_says}"


def worker_killed(cluster, folder):
    """Policy: a killed worker costs at most one attempt of each job that ran on it; the other workers continue."""
    run = LongRun(folder)
    node = cluster.nodes[0]
    held = run.rows("SELECT count(*) FROM attempts JOIN workers USING (worker_id)"
                    " WHERE outcome = 'running' AND hostname = ?", node.name)[0][0]
    for process in node.processes("legopt-worker"):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    leased_s = seconds_until("the leases' end", lambda: node.name not in run.at_work(), 20)
    expect(run.at_work(), "the other worker stopped, too")
    run.stop()
    charged = len(run.rows(CHARGES))
    expect(charged <= held, f"{charged} attempts charged, {held} jobs ran there: {run.rows(CHARGES)}")
    check_nothing_left(cluster)
    return f"{charged} of {held} attempts charged, jobs leased anew after {leased_s:.1f} s"


def step_killed(cluster, folder):
    """Policy: a worker whose slurmstepd is killed can no longer be stopped by Slurm. It continues to work, and ends by
    itself when the server is gone; nothing is charged."""
    run = LongRun(folder, POOL.replace("wait_server_s: 20", "wait_server_s: 4"))
    node = cluster.nodes[0]
    leases = engine.wait_for("running attempts", run.leases)
    steps = node.processes("slurmstepd")
    expect(steps, "no slurmstepd")
    for process in steps:
        os.kill(process, signal.SIGKILL)
    time.sleep(3)
    run.check_kept(leases)
    run.check_uncharged()
    run.interrupt()
    run.check_uncharged()
    engine.run("scancel", "--user=root")
    check_nothing_left(cluster)
    return "the worker worked on, and left when the server had"


def server_lost(cluster, folder):
    """Policy: a server that is stopped for 5 s, killed and restarted costs nothing; workers reconnect at once."""
    run = LongRun(folder)
    workers, leases = online(run), engine.wait_for("running attempts", run.leases)
    expect(len(workers) == 2, f"online {workers}")
    server = server_of(run)
    os.kill(server, signal.SIGSTOP)
    time.sleep(5)
    os.kill(server, signal.SIGKILL)
    began = time.monotonic()
    engine.wait_for("another server", lambda: server_of(run) not in (None, server))
    engine.wait_for("the same workers", lambda: online(run) == workers, 20)
    back_s = time.monotonic() - began
    run.check_kept(leases)
    run.check_uncharged()
    run.stop()
    run.check_uncharged()
    check_nothing_left(cluster)
    return f"both workers back after {back_s:.1f} s, with the same jobs"


def online(run):
    """Returns the names of the workers that its server considers online."""
    return {worker["name"] for worker in server_status(run).get("workers", []) if worker["online"]}


def solving(node):
    """Returns whether a job process there has used CPU time within a moment."""
    def used():
        total = 0
        for process in node.processes("legopt-worker"):
            try:
                with open(f"/proc/{process}/stat", encoding="ascii") as stat:
                    total += sum(map(int, stat.read().rsplit(")", 1)[1].split()[11:13]))
            except OSError:
                pass
        return total
    before = used()
    time.sleep(1)
    return used() - before > os.sysconf("SC_CLK_TCK") // 5


SCENARIOS = (cancelled, time_limit, preempted, daemons_killed, worker_killed, step_killed, server_lost, link_cut)
