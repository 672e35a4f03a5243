"""Datagrams of one deployment: the envelope, its tag, and the two multicast sockets."""

import hashlib
import hmac
import os
import socket
import stat
import struct
from collections import Counter

from wire import CHANNEL, SHORT_MAGIC, Malformed

VERSION = 11
REQUEST, REPLY, ERROR, REQUEST_CHUNK, REPLY_CHUNK, ACKNOWLEDGEMENT, PROOF = range(1, 8)
ON_BULK_PORT = (REQUEST_CHUNK, REPLY_CHUNK, ACKNOWLEDGEMENT)
SERVER = 1
FIRST_RANDOM_ADDRESS = 1 << 32
HEADER_BYTES = 92
FRAME_BYTES = 1200
PAYLOAD_BYTES = FRAME_BYTES - HEADER_BYTES
TAG = slice(72, 88)
VERSION_REFUSED = 1
ROLES = ("worker", "client")
RECEIVE_BUFFER_BYTES = 1 << 20


class UnusableKey(ValueError):
    """The key file must not be used; the message gives the reason."""


def read_key(path):
    """Returns the key of any role from a file that only its owner may read."""
    facts = os.stat(path)
    if not stat.S_ISREG(facts.st_mode):
        raise UnusableKey(f"{path}: not a regular file")
    if facts.st_uid not in (0, os.geteuid()) or stat.S_IMODE(facts.st_mode) not in (0o600, 0o400):
        raise UnusableKey(f"{path}: must be yours, and closed to others: chmod 600")
    with open(path, encoding="ascii") as file:
        text = file.read()
    digits = text[:-1] if text.endswith("\n") else text
    for role in ROLES:
        digits = digits.removeprefix(role + " ")
    if len(digits) != 64 or set(digits) - set("0123456789abcdefABCDEF"):
        raise UnusableKey(f"{path}: not 64 hexadecimal digits")
    return bytes.fromhex(digits)


def derived_key(key, role):
    """Returns the key of a role, derived from the full key."""
    return hashlib.blake2b(b"legopt " + role.encode("ascii"), digest_size=32, key=key).digest()


def deployment_number(group, port):
    """Returns FNV-1a of "group:port"."""
    value = 0xCBF29CE484222325
    for byte in f"{group}:{port}".encode("ascii"):
        value = ((value ^ byte) * 0x100000001B3) & (1 << 64) - 1
    return value & (1 << 63) - 1 or 1


def tag_of(frame, key):
    """Returns BLAKE2b-128 of an encoded frame with its own 16 bytes set to zero; an empty key means no tag."""
    return hashlib.blake2b(frame[:TAG.start] + bytes(16) + frame[TAG.stop:], digest_size=16, key=key).digest()


def random_number(low=1):
    """Returns 63 random bits, at least `low`."""
    while True:
        value = int.from_bytes(os.urandom(8), "big") >> 1
        if value >= low:
            return value


def on_loopback(group):
    """Returns struct ip_mreqn of the group on the loopback interface, on which a party with TTL 0 sends and listens."""
    return struct.pack("=4s4si", socket.inet_aton(group), bytes(4), socket.if_nametoindex("lo"))


def check_route(group, port):
    """Raises OSError immediately if loopback does not carry the group."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, on_loopback(group))
        probe.connect((group, port))


class Port:
    """Sends to the group and receives from it for one party. `counters` counts dropped packets by cause."""

    def __init__(self, messages, group, port, key=b"", deployment=None):
        self.messages = messages
        self.key = key
        self.deployment = deployment or deployment_number(group, port)
        self.version = VERSION
        self.address = random_number(FIRST_RANDOM_ADDRESS)
        self.counters = Counter()
        self._group = group
        self._ports = (port, port + 1)
        self._nonce = 0
        check_route(group, port)
        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, on_loopback(group))
        self.sockets = [self._join(number) for number in self._ports]

    def _join(self, port):
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        receiver.bind((self._group, port))
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                            on_loopback(self._group))
        receiver.setblocking(False)
        return receiver

    def close(self):
        for each in [self._sender, *self.sockets]:
            each.close()

    def send(self, kind, **header):
        """Sends one frame with a new nonce and tag. See frame.lcm for the names."""
        self._nonce += 1
        frame = self.messages.encode("frame", **{
            "version": self.version, "kind": kind, "deployment": self.deployment, "sender": self.address,
            "nonce": self._nonce, **header})
        frame = frame[:TAG.start] + tag_of(frame, self.key) + frame[TAG.stop:]
        packet = SHORT_MAGIC + struct.pack(">I", self._nonce & 0xFFFFFFFF) + CHANNEL + frame
        self.transmit(packet, kind in ON_BULK_PORT)

    def transmit(self, packet, bulk):
        try:
            self._sender.sendto(packet, (self._group, self._ports[bulk]))
        except OSError:
            self.counters["not sent"] += 1  # treated as lost: repeats cover it

    def receive(self, packet):
        """Returns the frame of a packet if it is valid and addressed to this party, else None."""
        frame, fault = self._check(packet)
        self.counters[fault or "received"] += 1
        return frame if not fault else None

    def _check(self, packet):
        start = len(SHORT_MAGIC) + 4 + len(CHANNEL)
        if packet[:4] != SHORT_MAGIC or packet[8:start] != CHANNEL:
            return None, "not ours"
        data = packet[start:]
        if not HEADER_BYTES <= len(data) <= FRAME_BYTES:
            return None, "size"
        try:
            frame = self.messages.decode("frame", data)
        except Malformed:
            return None, "malformed"
        if frame.deployment != self.deployment:
            return None, "other deployment"
        if frame.destination != self.address:
            return None, "for others"
        if not hmac.compare_digest(frame.tag, tag_of(data, self.key)):
            unsigned = self.key and hmac.compare_digest(frame.tag, tag_of(data, b""))
            return None, "unsigned" if unsigned else "tag"
        if not (REQUEST <= frame.kind <= PROOF and frame.type >= 1 and frame.sender >= 1 and frame.session >= 1
                and frame.call_id >= 1):
            return None, "range"
        if frame.version != VERSION and not (frame.kind == ERROR and frame.code == VERSION_REFUSED):
            return None, "version"
        return frame, ""
