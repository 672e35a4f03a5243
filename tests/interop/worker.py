#!/usr/bin/env python3
"""A legopt worker in Python, written from lcmtypes/PROTOCOL.md: an example for workers in other languages.

It answers jobs with the solutions of a LegOpt solution file; a job without one ends with outcome "error".
SIGTERM or Ctrl-C: running jobs are finished and delivered, and the others released; a second signal releases all jobs.
"""

import argparse
import asyncio
import os
import platform
import random
import signal
import socket
import sys
import time
from pathlib import Path

import frames
from answers import Answers, dataset_facts, no_answer
from endpoint import Endpoint, Refused, TimedOut
from wire import Messages

LCMTYPES = Path(__file__).resolve().parents[2] / "lcmtypes"
OK, NONE_NOW, UNKNOWN_WORKER, DATASET_MISMATCH, NO_MORE_WORK = range(5)  # lease_reply.status
HELLO_DATASET_MISMATCH = 2
CONTINUE, CANCEL, UNKNOWN_LEASE = range(3)  # heartbeat_reply
CANCELLED, ERROR = 4, 5                     # result_request.outcome
RESULT_WORDS = ("accepted", "accepted before", "stale", "refused")
TRY_AGAIN = (4, 7)  # codes after which a new call may succeed
EXIT_OK, EXIT_USAGE, EXIT_UNREACHABLE, EXIT_DATASET, EXIT_NETWORK = 0, 2, 3, 5, 7
STOP_SHARE = 0.9  # fraction of a lease after which no work of an attempt may run
HEARTBEAT_DEADLINE_S = 2.0
HELD_READY_S = 2.0  # a job that has waited this long behind others is released
MAX_LOG_BYTES = 1 << 16


class GivingUp(Exception):
    """This worker cannot work in this deployment."""

    def __init__(self, exit_code, text):
        super().__init__(text)
        self.exit_code = exit_code


class Job:
    """A lease that this worker holds, and its attempt."""

    def __init__(self, lease, asked):
        self.lease = lease
        self.verdict = CONTINUE
        self.stopped = asyncio.Event()
        self.renew(asked)

    def renew(self, asked):
        """Records that the server has renewed the lease after a request sent at `asked` or later."""
        self.ends = asked + self.lease.lease_us * STOP_SHARE / 1e6

    def stop(self, verdict):
        self.verdict = verdict
        self.stopped.set()

    async def work(self, seconds):
        """Simulates a solver's work. Returns false if the lease expired: then the worker must stop all work on the
        job."""
        begun = time.monotonic()
        while not self.stopped.is_set() and time.monotonic() < min(begun + seconds, self.ends):
            await sleep_unless(self.stopped, min(begun + seconds, self.ends) - time.monotonic())
        return time.monotonic() < self.ends

    def identity(self):
        return {"job_id": self.lease.job_id, "attempt": self.lease.attempt, "token": self.lease.token}


class Worker:
    """Registers, requests jobs, renews their leases, delivers results. Belongs to the running event loop."""

    def __init__(self, endpoint, answers, dataset, options):
        self._endpoint = endpoint
        self._answers = answers
        self._dataset = dataset
        self._capabilities = [{"kind": "dataset", "name": dataset["name"], "hash": dataset["hash"]}]
        for model in "solid", "surface", "surface_oriented":  # solutions come from a file for any collision model
            self._capabilities.append({"kind": "collision", "name": model, "hash": ""})
        self._options = options
        self._server = None  # the last hello_reply
        self._greeting = asyncio.Lock()
        self._jobs = set()
        self._methods = {}
        self._leaving = asyncio.Event()
        self._hurrying = False
        self._exit_code = EXIT_OK

    def leave(self):
        """First call: requests no more jobs. Second call: releases all current jobs as well."""
        if self._leaving.is_set():
            self._hurrying = True
            for job in self._jobs:
                job.stop(CANCEL)
        self._leaving.set()

    async def run(self):
        """Runs until asked to stop; returns the exit code. Throws GivingUp."""
        await self._hello(None)
        slots = [self._slot(number) for number in range(self._options.slots)]
        tasks = [asyncio.ensure_future(task) for task in [self._heartbeats(), *slots]]
        try:
            await asyncio.gather(*tasks)
            return self._exit_code
        finally:
            for task in tasks:
                task.cancel()

    async def _call(self, name, **fields):
        """Makes a call that is repeated after time-outs, since the server may be restarting."""
        while True:
            try:
                return await self._endpoint.call(name, **fields)
            except TimedOut as error:
                say(f"{name}: {error}")
                if self._hurrying or (self._leaving.is_set() and name != "result"):
                    raise GivingUp(EXIT_UNREACHABLE, "left without the server") from error
            except Refused as error:
                if error.code not in TRY_AGAIN:
                    raise GivingUp(EXIT_USAGE, f"{name}: {error}") from error
                say(f"{name}: {error}")
                await asyncio.sleep(1)

    async def _hello(self, outdated):
        """Registers, unless that was done since the hello_reply `outdated`."""
        async with self._greeting:
            if self._server is not outdated:
                return
            reply = await self._call(
                "hello", protocol_version=frames.VERSION, worker_name=self._options.name,
                hostname=socket.gethostname(), pid=os.getpid(), slots=self._options.slots,
                build="Python " + platform.python_version(), build_id="python-" + platform.python_version(),
                processor=platform.machine(), processors=os.cpu_count(), load=os.getloadavg()[0],
                capabilities=self._capabilities)
            if reply.status != OK:
                mismatch = reply.status == HELLO_DATASET_MISMATCH
                raise GivingUp(EXIT_DATASET if mismatch else EXIT_USAGE, reply.message)
            self._server = reply

    async def _heartbeats(self):
        """Renews all leases until the worker leaves; without leases, reports that the worker is alive."""
        while self._jobs or not self._leaving.is_set():
            await asyncio.sleep(self._server.heartbeat_us / 1e6)
            server, jobs, asked = self._server, list(self._jobs), time.monotonic()
            try:
                reply = await self._endpoint.call("heartbeat", deadline=HEARTBEAT_DEADLINE_S, **told(server),
                                                  load=os.getloadavg()[0], leases=[job.identity() for job in jobs])
            except (TimedOut, Refused) as error:
                say(f"heartbeat: {error}")  # jobs without renewal stop by themselves
                continue
            for job, verdict in zip(jobs, reply.verdicts):
                if verdict == CONTINUE:
                    job.renew(asked)
                else:
                    job.stop(verdict)
            if reply.status == UNKNOWN_WORKER or reply.server_instance != server.server_instance:
                await self._hello(server)

    async def _slot(self, number):
        while not self._leaving.is_set():
            server, asked = self._server, time.monotonic()
            reply = await self._call("lease", **told(server), slot=number, max_jobs=self._options.batch)
            if reply.status == OK:
                jobs = [Job(lease, asked) for lease in reply.jobs]
                self._jobs.update(jobs)
                turn = asyncio.Lock()
                await asyncio.gather(*(self._attempt(job, turn) for job in jobs))
            elif reply.status == UNKNOWN_WORKER:
                await self._hello(server)
            elif reply.status == DATASET_MISMATCH:
                say(reply.message)
                self._exit_code = EXIT_DATASET
                self._leaving.set()
            elif reply.status == NO_MORE_WORK and self._options.exit_when_idle:
                self._leaving.set()
            else:
                await sleep_unless(self._leaving, reply.retry_after_us / 1e6 * random.uniform(0.75, 1.25))

    async def _attempt(self, job, turn):
        """Runs a job from lease to report. The lease is renewed until the report is answered."""
        ours = await self._wait_for(turn, job)
        if not ours or self._leaving.is_set():
            job.stop(job.verdict or CANCEL)
        begun = time.monotonic()
        if await job.work(self._options.work) and job.verdict != UNKNOWN_LEASE:
            result = await self._result(job)
            await self._report(job, {"wall_us": int((time.monotonic() - begun) * 1e6), **result})
        else:
            say(f"job {job.lease.job_id}, attempt {job.lease.attempt}: lost")
        self._jobs.remove(job)
        if ours:
            turn.release()

    async def _wait_for(self, turn, job):
        """Waits until the slot has done the earlier jobs; returns false if that takes too long or is no longer
        needed."""
        events = [asyncio.ensure_future(event) for event in (turn.acquire(), job.stopped.wait(), self._leaving.wait())]
        await asyncio.wait(events, timeout=HELD_READY_S, return_when=asyncio.FIRST_COMPLETED)
        ours = events[0].done()
        for event in events:
            event.cancel()
        return ours

    async def _result(self, job):
        if job.verdict == CANCEL:
            return no_answer(CANCELLED, "stopped")
        log = f"method {job.lease.method_hash}, not used: {await self._method(job.lease.method_hash)}"
        result = self._answers.solve(job.lease) or no_answer(ERROR, "no solution is stored for this problem")
        return {**result, "log_tail": log[-MAX_LOG_BYTES:]}

    async def _method(self, method_hash):
        """Returns the canonical options of a hash, which a solver would need."""
        if method_hash not in self._methods:
            reply = await self._call("method", hash=method_hash)
            self._methods[method_hash] = reply.options_json if reply.status == OK else "unknown"
        return self._methods[method_hash]

    async def _report(self, job, result):
        reply = await self._call("result", worker_id=self._server.worker_id, **job.identity(), **result)
        say(f"job {job.lease.job_id}, attempt {job.lease.attempt}: outcome {result['outcome']}, "
            f"{RESULT_WORDS[reply.status]}{': ' if reply.message else ''}{reply.message}")


def told(server):
    """Returns the fields of the hello_reply that later requests repeat."""
    return {"worker_id": server.worker_id, "server_instance": server.server_instance}


async def sleep_unless(event, seconds):
    try:
        await asyncio.wait_for(event.wait(), max(seconds, 0))
    except asyncio.TimeoutError:
        pass


def say(text):
    print(text, file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dataset", required=True, help="dataset folder")
    parser.add_argument("--solutions", required=True, help="LegOpt solution file of that dataset")
    parser.add_argument("--legopt", default="legopt", help="the program that knows the dataset's hash and judges")
    parser.add_argument("--name", default="python", help="name in tables and listings")
    parser.add_argument("--slots", type=int, default=1, help="jobs at a time")
    parser.add_argument("--batch", type=int, default=1, help="jobs to ask for at a time")
    parser.add_argument("--work", type=float, default=0.0, help="seconds to spend on each job")
    parser.add_argument("--exit-when-idle", action="store_true", help="leave when every experiment is over")
    parser.add_argument("--group", default=os.environ.get("LEGOPT_GROUP", "239.255.76.67"))
    parser.add_argument("--port", type=int, default=os.environ.get("LEGOPT_PORT", "7667"))
    parser.add_argument("--deployment", type=int, default=os.environ.get("LEGOPT_DEPLOYMENT"))
    parser.add_argument("--key-file", default=os.environ.get("LEGOPT_KEY_FILE"))
    return parser.parse_args()


async def serve(options, port):
    endpoint = Endpoint(port)
    try:
        dataset = dataset_facts(options.legopt, options.dataset)
        answers = Answers(options.legopt, options.dataset, options.solutions)
        worker = Worker(endpoint, answers, dataset, options)
        for number in (signal.SIGTERM, signal.SIGINT):
            asyncio.get_running_loop().add_signal_handler(number, worker.leave)
        return await worker.run()
    finally:
        endpoint.close()


def main():
    options = parse_arguments()
    try:
        key = frames.read_key(options.key_file) if options.key_file else b""
    except (OSError, frames.UnusableKey) as error:
        say(str(error))
        return EXIT_USAGE
    if not key:
        say("no key: every program of this machine can command this deployment")
    try:
        port = frames.Port(Messages(LCMTYPES), options.group, options.port, key, options.deployment)
    except OSError as error:
        say(f"multicast to {options.group} is unusable: {error}")
        return EXIT_NETWORK
    try:
        return asyncio.run(serve(options, port))
    except GivingUp as error:
        say(str(error))
        return error.exit_code


if __name__ == "__main__":
    sys.exit(main())
