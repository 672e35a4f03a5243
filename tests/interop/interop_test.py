#!/usr/bin/env python3
"""Tests a Python worker, which uses nothing but PROTOCOL.md, with a real server.

Usage: interop_test.py BUILD_FOLDER [TEST ...]; exits with 77 (skipped) if multicast is unavailable.
"""

import asyncio
import hashlib
import json
import logging
import random
import re
import struct
import sys
import unittest

import frames
from answers import NAN, no_answer
from deployment import DATASET, GROUP, SOLUTIONS, SOURCE, Deployment, end, leave
from endpoint import TYPES, Endpoint, Refused, TimedOut
from frames import Port
from wire import Messages

LCMTYPES = SOURCE / "lcmtypes"
SKIPPED = 77
MOTION = {"task": "motion", "problems": [0]}
VERSION_REFUSED, UNKNOWN_TYPE, MALFORMED, KEY_NEEDED, ROLE_REFUSED = 1, 2, 3, 9, 10
ACCEPTED, DUPLICATE, STALE, REFUSED = range(4)
FINISHED, CRASHED, GIVEN_BACK = 0, 1, 4
build = ""


def postures(count):
    return {"task": "posture", "problems": list(range(count))}


class InjuredPort(Port):
    """Records sent packets; loses, repeats and damages fractions of them."""

    def __init__(self, *arguments, lost=0.0, repeated=0.0, damaged=0.0):
        super().__init__(*arguments)
        self.sent = []
        self._shares = (lost, repeated, damaged)
        self._random = random.Random(7)

    def transmit(self, packet, bulk):
        self.sent.append((packet, bulk))
        lost, repeated, damaged = (self._random.random() < share for share in self._shares)
        if damaged:
            at = self._random.randrange(frames.HEADER_BYTES, len(packet))
            packet = packet[:at] + bytes([packet[at] ^ 1]) + packet[at + 1:]
        for _ in range(0 if lost else 2 if repeated else 1):
            super().transmit(packet, bulk)


class ProtocolTest(unittest.TestCase):
    def test_vectors(self):
        messages = Messages(LCMTYPES)
        text = (LCMTYPES / "test-vectors.txt").read_text()
        vectors = {name: bytes.fromhex(digits) for name, digits in
                   re.findall(r"^vector (\S+)\n((?:[0-9a-f ]+(?:\n|$))+)", text, re.M)}
        key = vectors.pop("key")
        self.expect_envelopes(vectors, key)
        keys = {"request": b"", "request-worker": frames.derived_key(key, "worker")}
        for role in frames.ROLES:
            self.assertEqual(vectors.pop("key-" + role), frames.derived_key(key, role))
        self.assertEqual(len(vectors), 5)
        for name, vector in vectors.items():
            frame = messages.decode("frame", vector)
            self.assertEqual(messages.encode("frame", **vars(frame)), vector, name)
            self.assertEqual(frame.tag, frames.tag_of(vector, keys.get(name, key)), name)
        request = messages.decode("frame", vectors["request"])
        self.assertEqual(messages.decode("probe_request", request.payload).nonce, 42)

    def expect_envelopes(self, vectors, key):
        """Checks and removes the envelopes of bridges. Their tag is computed like a frame's, and one carries the
        keyed request."""
        knock, envelope = vectors.pop("knock-keyed"), vectors.pop("envelope-keyed")
        for whole in (knock, envelope):
            bare = whole[:48] + bytes(16) + whole[64:]
            self.assertEqual(hashlib.blake2b(bare, digest_size=16, key=key).digest(), whole[48:64])
        self.assertEqual(len(knock), 64)
        self.assertEqual(envelope[64:], vectors["request-keyed"])


class WorkerTest(unittest.TestCase):
    def deploy(self, **how):
        return self.enterContext(Deployment(build, **how))

    def expect_complete(self, deployment, jobs):
        self.assertEqual(deployment.query(
            "SELECT state, count(*), max(attempts - returned) FROM jobs GROUP BY state"), [("done", jobs, 1)])
        self.assertEqual(deployment.query("SELECT count(*) FROM attempts WHERE outcome = 'running'"), [(0,)])
        self.assertEqual(deployment.query("SELECT count(*) FROM results"), [(jobs,)])

    def test_jobs_end_once_with_what_was_reported(self):
        deployment = self.deploy()
        deployment.submit([postures(40), MOTION], max_attempts=2)
        code, words = leave(deployment.start_worker("--exit-when-idle", "--batch", "16", "--slots", "2"))
        self.assertEqual(code, 0, words)
        self.assertEqual(deployment.query(
            "SELECT task, state, count(*), max(attempts - returned) FROM jobs JOIN cells USING (cell_id) GROUP BY 1"),
            [("motion", "failed", 1, 2), ("posture", "done", 40, 1)])
        (message,) = deployment.query("SELECT message FROM failures")
        self.assertEqual(message, ("no solution is stored for this problem",))
        problems = json.loads(SOLUTIONS.read_text())["problems"]
        stored = {problem["id"]: problem["solution"][0]["x"] for problem in problems}
        rows = deployment.query("SELECT problem_id, hex(x) FROM waypoints JOIN job_list USING (job_id) ORDER BY 1")
        self.assertEqual([problem for problem, _ in rows], list(range(40)))
        for problem, x in rows:
            numbers = [float(number) for number in stored[problem][0].split()]
            self.assertEqual(bytes.fromhex(x), struct.pack(f"<{len(numbers)}d", *numbers))
        counters = deployment.counters()
        self.assertGreater(counters["objects_received"], 40, "results are large")
        self.assertGreater(counters["objects_sent"], 0, "a lease reply of many jobs is large")
        # The judge's verdicts of the exported solutions are the same.
        exported = deployment.folder / "exported.json"
        deployment.call("export", 1, "--dataset", DATASET, "--out", exported)
        judged = json.loads(deployment.client("evaluate", exported, "--dataset", DATASET, "--format", "json"))
        self.assertEqual(
            [(each["problem"], each["cost"], each["verdict_literal"], each["verdict_strict"])
             for each in judged["solutions"]],
            deployment.query("SELECT problem_id, cost, verdict_literal, verdict_strict FROM job_list WHERE "
                             "state = 'done' ORDER BY 1"))

    def test_goodbye(self):
        deployment = self.deploy(number=4711)
        experiment = deployment.submit([postures(40)])
        worker = deployment.start_worker("--batch", "8", "--work", "0.3")
        deployment.wait_for(experiment, "done", 2)
        code, words = end(worker)
        self.assertEqual(code, 0, words)
        self.assertEqual(deployment.jobs(experiment)["leased"], 0)
        self.assertEqual(deployment.query("SELECT DISTINCT outcome FROM attempts ORDER BY 1"),
                         [("finished",), ("returned",)])
        leave(deployment.start_worker("--exit-when-idle"))
        self.expect_complete(deployment, 40)

    def test_restart_with_a_key(self):
        deployment = self.deploy(key=True)
        experiment = deployment.submit([postures(12)])
        worker = deployment.start_worker("--exit-when-idle", "--slots", "2", "--work", "1")
        for done in (2, 6):
            deployment.wait_for(experiment, "done", done)
            deployment.kill_server()
            deployment.start_server()
        code, words = leave(worker)
        self.assertEqual(code, 0, words)
        self.expect_complete(deployment, 12)
        # A lease lost in a crash of the server before its reply was sent is an attempt without a worker.
        self.assertEqual(
            deployment.query("SELECT count(*) FROM attempts WHERE message NOT LIKE '%never received the lease%'"),
            [(12,)], words)


class EndpointTest(unittest.IsolatedAsyncioTestCase):
    """The rules of calls and reports, tested with the worker's endpoint."""

    async def asyncTearDown(self):
        for endpoint in self._endpoints:
            endpoint.close()

    def setUp(self):
        self._endpoints = []

    def endpoint(self, deployment, key=b"", **injuries):
        port = InjuredPort(Messages(LCMTYPES), GROUP, deployment.port, key, **injuries)
        self._endpoints.append(Endpoint(port))
        return self._endpoints[-1]

    async def register(self, endpoint):
        dataset = {"kind": "dataset", "name": "any", "hash": self._hash}
        collision = {"kind": "collision", "name": "solid", "hash": ""}
        hello = await endpoint.call("hello", protocol_version=frames.VERSION, worker_name="test", pid=1, slots=1,
                                    build_id="test", processors=1, capabilities=[dataset, collision])
        self.assertEqual(hello.status, 0, hello.message)
        return {"worker_id": hello.worker_id, "server_instance": hello.server_instance}

    async def lease(self, endpoint, told):
        reply = await endpoint.call("lease", **told, max_jobs=1)
        self.assertEqual(reply.status, 0, reply.message)
        (lease,) = reply.jobs
        return lease, {"worker_id": told["worker_id"], "job_id": lease.job_id, "attempt": lease.attempt,
                       "token": lease.token}

    def deploy(self, **how):
        deployment = self.enterContext(Deployment(build, **how))
        (facts,) = json.loads(deployment.client("dataset", "info", DATASET, "--format", "json"))
        self._hash = facts["hash"]
        return deployment

    def specification(self):
        """Returns a specification with one job by PROTOCOL.md, section 9."""
        return {"spec_version": 1, "name": "interop", "seed": 1, "repetitions": 1,
                "dataset": {"name": "any", "hash": self._hash},
                "tasks": [{"task": "posture", "problems": [0], "waypoints": [1]}], "initializations": ["good"],
                "methods": [{"name": "none", "hash": "a" * 64, "options": {"solver": "none"}, "multi_starts": 0,
                             "sample_size": 100, "incremental": False}],
                "limits": {"wall_time_s": {"posture": 60}, "memory_mb": 64}}

    async def expect_refusal(self, code, word, call):
        with self.assertRaises(Refused) as caught:
            await call
        self.assertEqual(caught.exception.code, code)
        self.assertIn(word, str(caught.exception))

    async def test_bad_calls_are_refused(self):
        endpoint = self.endpoint(self.deploy())
        result = TYPES["result"]
        body = endpoint.port.messages.encode("result_request", worker_id=1, job_id=1, attempt=1, token=1)
        await self.expect_refusal(MALFORMED, "", endpoint.call_with(result, body[:-1]))
        await self.expect_refusal(MALFORMED, "", endpoint.call_with(result, body + b"\0"))
        await self.expect_refusal(MALFORMED, "", endpoint.call_with(result, b"?" + body[1:]))
        for field, value in {"outcome": 7, "attempt": 0, "cost": float("inf"), "exit_signal": 65}.items():
            fields = {"worker_id": 1, "job_id": 1, "attempt": 1, "token": 1, field: value}
            await self.expect_refusal(MALFORMED, field, endpoint.call("result", **fields))
        await self.expect_refusal(UNKNOWN_TYPE, "", endpoint.call_with(99, body))
        endpoint.port.version = 2
        await self.expect_refusal(VERSION_REFUSED, "version", endpoint.call("probe", nonce=1))

    async def test_each_report_counts_once_and_only_under_its_lease(self):
        deployment = self.deploy()
        deployment.submit([postures(1)])
        endpoint = self.endpoint(deployment)
        told = await self.register(endpoint)

        async def report(status, attempt, result):
            reply = await endpoint.call("result", **attempt, **result)
            self.assertEqual(reply.status, status, reply.message)

        _, first = await self.lease(endpoint, told)
        await report(REFUSED, {**first, "token": first["token"] ^ 2}, no_answer(CRASHED, ""))
        await report(ACCEPTED, first, no_answer(GIVEN_BACK, ""))
        await report(DUPLICATE, first, no_answer(GIVEN_BACK, ""))
        await report(STALE, first, no_answer(CRASHED, ""))

        _, second = await self.lease(endpoint, told)
        self.assertNotEqual(second["token"], first["token"])
        await report(REFUSED, second, {**no_answer(FINISHED, ""), "verdict_literal": "excellent"})

        _, third = await self.lease(endpoint, told)
        verdict = {"verdict_literal": "not_finite", "verdict_strict": "not_finite", "verdict_solid": "not_finite",
                   "verdict_physical": "not_finite"}
        large = {**no_answer(FINISHED, ""), **verdict, "trace": bytes(300_000)}
        endpoint = self.endpoint(deployment, lost=0.1, repeated=0.1, damaged=0.1)
        await report(ACCEPTED, third, large)
        await report(DUPLICATE, third, large)
        await report(STALE, third, no_answer(CRASHED, ""))
        counters = deployment.counters()
        self.assertGreater(counters["rejected_tag"], 0)
        self.assertGreater(counters["duplicate_chunks"], 0)
        self.assertEqual(counters["rejected_object"], 0)
        self.assertEqual(deployment.query("SELECT state, attempts, returned FROM jobs"), [("done", 3, 1)])
        self.assertEqual(deployment.query("SELECT outcome FROM attempts ORDER BY attempt"),
                         [("returned",), ("error",), ("finished",)])
        self.assertEqual(deployment.query("SELECT length(trace) FROM results"), [(300_000,)])

    async def test_leases_outlive_the_server(self):
        deployment = self.deploy()
        endpoint = self.endpoint(deployment)
        reply = await endpoint.call("submit", submission_id="a", spec_json=json.dumps(self.specification()))
        self.assertEqual((reply.status, reply.num_jobs), (0, 1), reply.message)
        told = await self.register(endpoint)
        lease, held = await self.lease(endpoint, told)
        deployment.kill_server()
        deployment.start_server()
        state = {name: held[name] for name in ("job_id", "attempt", "token")}
        reply = await endpoint.call("heartbeat", **told, leases=[state, {**state, "token": state["token"] ^ 2}])
        self.assertEqual((reply.status, list(reply.verdicts)), (2, [0, 2]), "known by its token before its name")
        self.assertNotEqual(reply.server_instance, told["server_instance"])
        self.assertEqual((await endpoint.call("lease", **told, max_jobs=1)).status, 2)
        reply = await endpoint.call("result", **held, **no_answer(GIVEN_BACK, ""))
        self.assertEqual(reply.status, ACCEPTED, "a report needs no hello")
        reply = await endpoint.call("method", hash=lease.method_hash)
        self.assertEqual(json.loads(reply.options_json), {"solver": "none"})

    async def test_nothing_counts_without_the_key_and_nothing_twice(self):
        deployment = self.deploy(key=True)
        experiment = deployment.submit([postures(1)])
        key = frames.read_key(deployment.key_file)
        await self.expect_refusal(KEY_NEEDED, "key", self.endpoint(deployment).call("probe", nonce=1))
        with self.assertRaises(TimedOut):
            await self.endpoint(deployment, key[::-1]).call("probe", nonce=1, deadline=0.5)
        endpoint = self.endpoint(deployment, key)
        await endpoint.call("control", experiment_id=experiment, action=0)
        self.assertEqual(deployment.query("SELECT hold FROM experiment_list"), [("paused",)])
        worker = self.endpoint(deployment, frames.derived_key(key, "worker"))
        self.assertEqual((await worker.call("probe", nonce=1)).protocol_version, frames.VERSION)
        await self.expect_refusal(ROLE_REFUSED, "worker", worker.call("control", experiment_id=experiment, action=1))
        deployment.call("resume", experiment)
        recorded = list(endpoint.port.sent)
        for restarted in (False, True):
            if restarted:
                deployment.kill_server()
                deployment.start_server()
            before = deployment.counters()
            for packet, bulk in recorded:
                frames.Port.transmit(endpoint.port, packet, bulk)
            await endpoint.call("probe", nonce=2)
            after = deployment.counters()
            self.assertGreater(after["rejected_replay"], before["rejected_replay"])
            self.assertEqual(deployment.query("SELECT hold FROM experiment_list"), [("none",)])


def main():
    global build
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    build = sys.argv.pop(1)
    logging.getLogger("asyncio").setLevel(logging.ERROR)  # suppresses warnings that the client program is slow
    try:
        frames.check_route(GROUP, 1)
    except OSError as error:
        print(f"SKIPPED, NO MULTICAST HERE: {error}", file=sys.stderr)
        return SKIPPED
    return unittest.main(verbosity=2)


if __name__ == "__main__":
    sys.exit(main())
