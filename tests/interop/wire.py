"""LCM's encoding, generated at run time from the .lcm files: a message is bytes on the wire and a namespace in
Python."""

import math
import re
import struct
from pathlib import Path
from types import SimpleNamespace

# Prefix of LCM's short datagrams: magic, sequence number, channel.
SHORT_MAGIC = b"LC02"
CHANNEL = b"LEGOPT\0"

PRIMITIVES = {
    "int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q",
    "float": "f", "double": "d", "byte": "B", "boolean": "?",
}
MASK = (1 << 64) - 1


class Malformed(ValueError):
    """Bytes that do not decode as the message."""


class Field:
    def __init__(self, kind, name, size):
        self.kind = kind  # a primitive, "string", or another message of the package
        self.name = name
        self.size = size  # None, a number, or the name of the field that counts the elements


def _hash_step(value, byte):
    signed = value - (1 << 64) if value >> 63 else value
    return ((value << 8) ^ (signed >> 55)) + byte & MASK


def _hash_text(value, text):
    value = _hash_step(value, len(text))
    for byte in text.encode():
        value = _hash_step(value, byte)
    return value


class Messages:
    """All messages of a folder of .lcm files."""

    def __init__(self, folder):
        self._fields = {}
        for file in sorted(Path(folder).glob("*.lcm")):
            self._parse(re.sub(r"//[^\n]*", "", file.read_text()))
        self._fingerprints = {name: struct.pack(">Q", self._fingerprint(name)) for name in self._fields}

    def _parse(self, text):
        name, body = re.search(r"struct\s+(\w+)\s*\{(.*?)\}", text, re.S).groups()
        self._fields[name] = [
            Field(kind, field, int(size) if size.isdigit() else size or None)
            for kind, field, size in re.findall(r"(\w+)\s+(\w+)\s*(?:\[(\w+)\])?\s*;", body)
        ]

    def _fingerprint(self, name):
        value = 0x12345678
        for field in self._fields[name]:
            value = _hash_text(value, field.name)
            if field.kind not in self._fields:
                value = _hash_text(value, field.kind)
            value = _hash_step(value, 0 if field.size is None else 1)  # number of dimensions
            if field.size is not None:
                value = _hash_step(value, 0 if isinstance(field.size, int) else 1)  # constant or variable
                value = _hash_text(value, str(field.size))
        parts = [self._fingerprint(field.kind) for field in self._fields[name] if field.kind in self._fields]
        total = (value + sum(parts)) & MASK if parts else value
        return (total << 1 & MASK) | total >> 63

    # Encoding

    def encode(self, name, **values):
        """Encodes a message. Omitted fields are 0, empty, or counted."""
        return self._fingerprints[name] + self._encode_fields(name, values)

    def _encode_fields(self, name, values):
        unknown = set(values) - {field.name for field in self._fields[name]}
        if unknown:
            raise TypeError(f"{name} has no field {', '.join(sorted(unknown))}")
        counts = {field.size: len(values.get(field.name, ())) for field in self._fields[name]
                  if isinstance(field.size, str)}
        return b"".join(self._encode_field(field, values.get(field.name, counts.get(field.name)))
                        for field in self._fields[name])

    def _encode_field(self, field, value):
        if field.size is None:
            return self._encode_one(field.kind, value)
        if value is None:
            value = [] if isinstance(field.size, str) else bytes(field.size)
        if field.kind == "byte":
            return bytes(value)
        if field.kind in PRIMITIVES:
            return struct.pack(f">{len(value)}{PRIMITIVES[field.kind]}", *value)
        return b"".join(self._encode_one(field.kind, element) for element in value)

    def _encode_one(self, kind, value):
        if kind == "string":
            data = (value or "").encode()
            return struct.pack(">i", len(data) + 1) + data + b"\0"
        if kind in PRIMITIVES:
            return struct.pack(">" + PRIMITIVES[kind], value or 0)
        return self._encode_fields(kind, value)

    # Decoding

    def decode(self, name, data):
        """Returns a namespace of the fields. Every byte must be consumed."""
        if data[:8] != self._fingerprints[name]:
            raise Malformed(f"not a {name}")
        message, end = self._decode_fields(name, data, 8)
        if end != len(data):
            raise Malformed(f"{len(data) - end} bytes too many behind a {name}")
        return message

    def _decode_fields(self, name, data, at):
        message = SimpleNamespace()
        for field in self._fields[name]:
            value, at = self._decode_field(field, message, data, at)
            setattr(message, field.name, value)
        return message, at

    def _decode_field(self, field, message, data, at):
        if field.size is None:
            return self._decode_one(field.kind, data, at)
        count = field.size if isinstance(field.size, int) else getattr(message, field.size)
        if not 0 <= count <= len(data) - at:
            raise Malformed(f"{field.name}: {count} elements cannot be")
        if field.kind == "byte":
            return data[at:at + count], at + count
        elements = []
        for _ in range(count):
            element, at = self._decode_one(field.kind, data, at)
            elements.append(element)
        return elements, at

    def _decode_one(self, kind, data, at):
        if kind not in PRIMITIVES and kind != "string":
            return self._decode_fields(kind, data, at)
        try:
            if kind == "string":
                (size,) = struct.unpack_from(">i", data, at)
                text = data[at + 4:at + 4 + size]
                if size < 1 or len(text) != size or text.find(b"\0") != size - 1:
                    raise Malformed("a text without its end")
                return text[:-1].decode(), at + 4 + size
            (value,) = struct.unpack_from(">" + PRIMITIVES[kind], data, at)
        except (struct.error, UnicodeDecodeError) as error:
            raise Malformed(str(error)) from error
        if kind == "double" and math.isinf(value):
            raise Malformed("an infinity")
        return value, at + struct.calcsize(PRIMITIVES[kind])
