"""Bodies larger than one frame: split into acknowledged chunks on one side, reassembled on the other."""

import asyncio
import hashlib
import time

CHUNK_BYTES = 1024
MAX_BODY_BYTES = 64 << 20
MAX_INCOMPLETE_BYTES = 256 << 20
PATIENCE_S = 10.0
FIRST_CREDIT = 8
WINDOW = 64
ACK_EVERY = 8
LATER_FOR_LOSS = 3
FIRST_TIMEOUT_S, MIN_TIMEOUT_S, MAX_TIMEOUT_S = 0.1, 0.02, 1.0
SHARED_CREDIT, MIN_CREDIT, MAX_CREDIT = 60, 2, 32


def body_hash(body):
    return hashlib.blake2b(body, digest_size=32).digest()


class Stalled(Exception):
    """No chunk was acknowledged for too long."""


class RoundTrip:
    """Round-trip estimate of RFC 6298, sampled only from chunks that were sent once."""

    def __init__(self):
        self.smoothed = None
        self._variation = 0.0
        self._backoff = 1

    def sample(self, seconds):
        self._backoff = 1
        if self.smoothed is None:
            self.smoothed, self._variation = seconds, seconds / 2
        else:
            self._variation += (abs(self.smoothed - seconds) - self._variation) / 4
            self.smoothed += (seconds - self.smoothed) / 8

    def back_off(self):
        self._backoff *= 2

    @property
    def timeout(self):
        base = FIRST_TIMEOUT_S if self.smoothed is None else self.smoothed + 4 * self._variation
        return min(max(base, MIN_TIMEOUT_S) * self._backoff, MAX_TIMEOUT_S)


class OutgoingBody:
    """One body in transmission to one receiver. `transmit(chunk fields)` sends a chunk."""

    def __init__(self, body, transmit):
        self._body = body
        self._hash = body_hash(body)
        self._transmit = transmit
        self._count = -(-len(body) // CHUNK_BYTES)
        self._round_trip = RoundTrip()
        self._news = asyncio.Event()
        self._old_reassembly = None
        self.complete = False
        self._begin(None)

    def _begin(self, reassembly):
        """Resets the state: nothing has arrived."""
        self._reassembly = reassembly
        self._arrived = set()
        self._below = 0        # every chunk with a smaller index has arrived
        self._flying = {}      # chunk -> number and time of its transmission
        self._repeated = set()
        self._transmissions = 0
        self._latest = 0       # largest number of an acknowledged transmission
        self._credit = FIRST_CREDIT

    async def deliver(self):
        """Returns when the receiver has verified the whole body."""
        progress = time.monotonic()
        while not self.complete:
            self._fill()
            before = len(self._arrived), self._reassembly
            self._news.clear()
            try:
                await asyncio.wait_for(self._news.wait(), self._until_next_loss())
            except asyncio.TimeoutError:
                pass
            if (len(self._arrived), self._reassembly) != before:
                progress = time.monotonic()
            elif time.monotonic() - progress > PATIENCE_S:
                raise Stalled
            self._give_up_lost()

    def remind(self):
        """Repeats the request whose body is complete."""
        self._send(0, True)

    def abandon(self):
        """Ends the transmission, since the call is over."""
        self.complete = True
        self._news.set()

    def acknowledge(self, ack):
        """Processes a chunk_ack. Returns true if the receiver has lost a body that it had completed."""
        self._credit = min(max(ack.credit, 1), MAX_CREDIT)
        lost_again = False
        if ack.complete:
            self.complete = True
        elif ack.reassembly != self._old_reassembly:
            if self._reassembly not in (None, ack.reassembly):
                lost_again, self.complete = self.complete, False
                self._old_reassembly = self._reassembly
                self._begin(ack.reassembly)
            self._reassembly = ack.reassembly
            self._take(range(self._below, min(ack.received_below, self._count)))
            self._take(ack.received_below + 1 + i for i in range(64) if ack.received_mask >> i & 1)
        self._news.set()
        return lost_again

    def _take(self, chunks):
        sample = None
        for chunk in chunks:
            self._arrived.add(chunk)
            number, sent = self._flying.pop(chunk, (0, 0))
            if number > self._latest:
                self._latest = number
                sample = None if chunk in self._repeated else sent
        if sample is not None:
            self._round_trip.sample(time.monotonic() - sample)
        while self._below in self._arrived:
            self._below += 1

    def _fill(self):
        window = range(self._below, min(self._below + WINDOW + 1, self._count))
        ready = [chunk for chunk in window if chunk not in self._arrived and chunk not in self._flying]
        ready = ready[:max(self._credit - len(self._flying), 0)]
        for chunk in ready:
            self._flying[chunk] = self._transmissions + 1, time.monotonic()
            before_pause = chunk == ready[-1]
            self._send(chunk, chunk in self._repeated or before_pause or chunk % ACK_EVERY == ACK_EVERY - 1)

    def _send(self, chunk, ack_requested):
        self._transmissions += 1
        self._transmit(total_bytes=len(self._body), hash=self._hash, index=chunk, ack_requested=int(ack_requested),
                       data=self._body[chunk * CHUNK_BYTES:(chunk + 1) * CHUNK_BYTES])

    def _until_next_loss(self):
        now = time.monotonic()
        oldest = min((sent for _, sent in self._flying.values()), default=now)
        return max(oldest + self._round_trip.timeout - now, 0.001)

    def _give_up_lost(self):
        now, timeout = time.monotonic(), self._round_trip.timeout
        late = {chunk for chunk, (_, sent) in self._flying.items() if now - sent >= timeout}
        if late:
            self._round_trip.back_off()
        overtaken = {chunk for chunk, (number, sent) in self._flying.items()
                     if number + LATER_FOR_LOSS <= self._latest and now - sent >= (self._round_trip.smoothed or 0)}
        for chunk in late | overtaken:
            del self._flying[chunk]
            self._repeated.add(chunk)


class IncomingBody:
    """One body that is being reassembled."""

    def __init__(self, total_bytes, expected_hash, reassembly):
        self.total_bytes = total_bytes
        self.hash = expected_hash
        self.reassembly = reassembly
        self.last_news = time.monotonic()
        self._count = -(-total_bytes // CHUNK_BYTES)
        self._chunks = {}

    def fits(self, chunk):
        """Returns whether a chunk may belong to this body."""
        size = min(CHUNK_BYTES, self.total_bytes - chunk.index * CHUNK_BYTES)
        return (chunk.total_bytes == self.total_bytes and chunk.hash == self.hash
                and 0 <= chunk.index < self._count and len(chunk.data) == size)

    def add(self, chunk):
        """Stores a chunk; returns false if it was stored before."""
        if chunk.index in self._chunks:
            return False
        self._chunks[chunk.index] = chunk.data
        self.last_news = time.monotonic()
        return True

    @property
    def full(self):
        return len(self._chunks) == self._count

    def body(self):
        """Returns the whole body; None if it differs from the announced one."""
        body = b"".join(self._chunks[i] for i in range(self._count))
        return body if body_hash(body) == self.hash else None

    def acknowledgement(self, credit, complete=False):
        """Returns the fields of a chunk_ack."""
        below = next(i for i in range(self._count + 1) if i not in self._chunks)
        mask = sum(1 << i for i in range(64) if below + 1 + i in self._chunks)
        return {"of_reply": 1, "complete": int(complete), "reassembly": self.reassembly, "received_below": below,
                "received_mask": mask - (1 << 64) if mask >> 63 else mask, "credit": credit}


class IncomingReplies:
    """All incoming replies of one party, by call."""

    def __init__(self):
        self._bodies = {}
        self._reassemblies = 0

    def take(self, call_id, chunk, acknowledge):
        """Processes a chunk; returns the body that it completes, else None."""
        self._forget_silent()
        body = self._bodies.get(call_id) or self._start(call_id, chunk)
        if body is None or not body.fits(chunk):
            return None
        new = body.add(chunk)
        if body.full:
            del self._bodies[call_id]
            whole = body.body()
            if whole is not None:
                acknowledge(**body.acknowledgement(self._credit(), complete=True))
            return whole
        if chunk.ack_requested or not new:
            acknowledge(**body.acknowledgement(self._credit()))
        return None

    def forget(self, call_id):
        self._bodies.pop(call_id, None)

    def _start(self, call_id, chunk):
        under_way = sum(body.total_bytes for body in self._bodies.values())
        if not 1 <= chunk.total_bytes <= MAX_BODY_BYTES or under_way + chunk.total_bytes > MAX_INCOMPLETE_BYTES:
            return None
        self._reassemblies += 1
        body = IncomingBody(chunk.total_bytes, chunk.hash, self._reassemblies)
        if not body.fits(chunk):
            return None
        self._bodies[call_id] = body
        return body

    def _credit(self):
        return max(MIN_CREDIT, min(MAX_CREDIT, SHARED_CREDIT // max(len(self._bodies), 1)))

    def _forget_silent(self):
        oldest = time.monotonic() - PATIENCE_S
        self._bodies = {call: body for call, body in self._bodies.items() if body.last_news > oldest}
