"""Calls to the server of a deployment, repeated until a reply, a refusal or the deadline."""

import asyncio
import random

import frames
from bodies import IncomingReplies, OutgoingBody, Stalled
from frames import ACKNOWLEDGEMENT, ERROR, PROOF, REPLY, REPLY_CHUNK, REQUEST, REQUEST_CHUNK, SERVER
from wire import Malformed

TYPES = {"probe": 1, "hello": 2, "lease": 3, "heartbeat": 4, "result": 5, "method": 6, "submit": 7, "status": 8,
         "query": 9, "cancel": 10, "shutdown": 11, "control": 12}
BUSY, PROVE_SESSION = 6, 8
FIRST_INTERVAL_S, MAX_INTERVAL_S = 0.05, 1.0
MAX_PROMPT_REPEATS = 4
DEFAULT_DEADLINE_S = 10.0


class Refused(Exception):
    """An error reply: `code` of PROTOCOL.md, section 8, and a message."""

    def __init__(self, code, text):
        super().__init__(f"refused with code {code}: {text}")
        self.code = code


class TimedOut(Exception):
    """No answer; whether the server executed the call is unknown."""


class _Call:
    def __init__(self, number, kind, body):
        self.number = number
        self.type = kind
        self.body = body
        self.outgoing = None  # a large body in transmission
        self.prompt_repeats = 0
        self.again = asyncio.Event()  # the large body has to be sent again
        self.reply = asyncio.get_running_loop().create_future()


class Endpoint:
    """One caller during its lifetime: an address, a session, its numbered calls. Belongs to the running event loop."""

    def __init__(self, port):
        self.port = port
        self._messages = port.messages
        self._session = frames.random_number()
        self._last_call = 0
        self._calls = {}
        self._incoming = IncomingReplies()
        self._one_large_body = asyncio.Lock()  # so that the credit applies to all bodies together
        self._loop = asyncio.get_running_loop()
        for each in port.sockets:
            self._loop.add_reader(each, self._drain, each)

    def close(self):
        for each in self.port.sockets:
            self._loop.remove_reader(each)
        self.port.close()

    async def call(self, name, deadline=DEFAULT_DEADLINE_S, **fields):
        """Calls the server with the fields of a request. Returns the reply."""
        body = self._messages.encode(name + "_request", **fields)
        return self._messages.decode(name + "_reply", await self.call_with(TYPES[name], body, deadline))

    async def call_with(self, kind, body, deadline=DEFAULT_DEADLINE_S):
        """Calls the server with an encoded body; returns that of the reply."""
        self._last_call += 1
        call = _Call(self._last_call, kind, body)
        self._calls[call.number] = call
        work = asyncio.ensure_future(self._pursue(call))
        try:
            await asyncio.wait({work, call.reply}, timeout=deadline, return_when=asyncio.FIRST_COMPLETED)
            if call.reply.done():
                return call.reply.result()
            if work.done():
                work.result()  # raises its exception, if any
            raise TimedOut(f"no answer within {deadline} s")
        finally:
            work.cancel()
            del self._calls[call.number]
            self._incoming.forget(call.number)
            if call.outgoing:
                call.outgoing.abandon()

    async def _pursue(self, call):
        interval = FIRST_INTERVAL_S
        if len(call.body) > frames.PAYLOAD_BYTES:
            call.outgoing = OutgoingBody(call.body, lambda **chunk: self._send(
                call, REQUEST_CHUNK, self._messages.encode("chunk", **chunk)))
            await self._deliver(call)
        else:
            self._request(call)
        while True:
            pause = interval * random.uniform(0.75, 1.25)
            interval = min(2 * interval, MAX_INTERVAL_S)
            try:
                await asyncio.wait_for(call.again.wait(), pause)
                await self._deliver(call)
            except asyncio.TimeoutError:
                if call.outgoing:
                    call.outgoing.remind()
                else:
                    self._request(call)

    async def _deliver(self, call):
        async with self._one_large_body:
            call.again.clear()
            while True:
                try:
                    return await call.outgoing.deliver()
                except Stalled:
                    pass  # the deadline decides

    def _request(self, call):
        self._send(call, REQUEST, call.body)

    def _send(self, call, kind, payload):
        self.port.send(kind, type=call.type, destination=SERVER, session=self._session, call_id=call.number,
                       completed_below=min(self._calls) if kind in (REQUEST, REQUEST_CHUNK) else 0, payload=payload)

    # Receiving

    def _drain(self, each):
        while True:
            try:
                packet = each.recv(65536)
            except (BlockingIOError, InterruptedError):
                return
            frame = self.port.receive(packet)
            if frame and frame.sender == SERVER and frame.session == self._session:
                self._take(frame)

    def _take(self, frame):
        call = self._calls.get(frame.call_id)
        open_call = call is not None and not call.reply.done() and call.type == frame.type
        if frame.kind == REPLY_CHUNK:
            self._take_chunk(frame, call if open_call else None)
        elif not open_call:
            self.port.counters["late"] += 1
        elif frame.kind == REPLY:
            call.reply.set_result(frame.payload)
        elif frame.kind == ERROR:
            self._take_error(frame, call)
        elif frame.kind == ACKNOWLEDGEMENT and call.outgoing:
            self._take_acknowledgement(frame, call)

    def _take_error(self, frame, call):
        if frame.code == PROVE_SESSION and self.port.key:
            self._send(call, PROOF, frame.payload)
            if call.prompt_repeats < MAX_PROMPT_REPEATS and not call.outgoing:
                call.prompt_repeats += 1
                self._request(call)
        elif frame.code != BUSY:
            call.reply.set_exception(Refused(frame.code, frame.payload.decode("utf-8", "replace")))

    def _take_acknowledgement(self, frame, call):
        try:
            ack = self._messages.decode("chunk_ack", frame.payload)
        except Malformed:
            return
        if not ack.of_reply and call.outgoing.acknowledge(ack):
            call.again.set()

    def _take_chunk(self, frame, call):
        try:
            chunk = self._messages.decode("chunk", frame.payload)
        except Malformed:
            return

        def acknowledge(**fields):
            self.port.send(ACKNOWLEDGEMENT, type=frame.type, destination=SERVER, session=self._session,
                           call_id=frame.call_id, payload=self._messages.encode("chunk_ack", **fields))

        if call is None:
            acknowledge(of_reply=1, complete=1, credit=1)
            return
        body = self._incoming.take(frame.call_id, chunk, acknowledge)
        if body is not None:
            call.reply.set_result(body)
