"""Convergence of a job's solve. docs/reference/database.md, "Traces", describes the layout."""

from __future__ import annotations

import struct
from typing import Any

from .errors import DatabaseError
from .json_text import read_json
from .rows import Rows
from .zstd import decompress

COLUMNS = ["step", "window", "restart", "start", "penalty", "trust_box", "accepted", "evaluations", "elapsed_us",
           "cost", "violation"]

# Columns of the first part in order, each with the struct code of its values.
_STORED = [("step", "i"), ("window", "i"), ("restart", "i"), ("start", "i"), ("accepted", "B"), ("evaluations", "q"),
           ("penalty", "d"), ("trust_box", "d"), ("cost", "d"), ("violation", "d")]
_BYTES_PER_ROW = sum(struct.calcsize("<" + code) for _, code in _STORED)
_TIME_BYTES = 8
_LENGTH_BYTES = 4
_MOST_BYTES = 16 << 20  # size of a part: legopt writes no larger one


def decode_trace(packed: bytes, source: str) -> Rows:
    """Returns the rows of a `trace` column. DatabaseError, with `source` in its message, if it is damaged."""

    def refuse(what: str) -> DatabaseError:
        return DatabaseError(f"{source}: the trace {what}; the database or the worker that wrote it is damaged")

    if len(packed) < _LENGTH_BYTES:
        raise refuse("ends before it begins")
    length = int.from_bytes(packed[:_LENGTH_BYTES], "little")
    parts = packed[_LENGTH_BYTES:]
    if length > len(parts):
        raise refuse("is cut off")
    try:
        plain, times = decompress(parts[:length], _MOST_BYTES), decompress(parts[length:], _MOST_BYTES)
    except ValueError as error:
        raise refuse(f"cannot be decompressed ({error})") from error
    count, rest = divmod(len(times), _TIME_BYTES)
    if rest or count * _BYTES_PER_ROW != len(plain):
        raise refuse("has columns of different lengths")
    columns: dict[str, tuple[Any, ...]] = {"elapsed_us": struct.unpack(f"<{count}q", times)}
    offset = 0
    for name, code in _STORED:
        columns[name] = struct.unpack_from(f"<{count}{code}", plain, offset)
        offset += struct.calcsize(f"<{count}{code}")
    columns["accepted"] = tuple(int(value != 0) for value in columns["accepted"])
    return Rows(COLUMNS, (dict(zip(COLUMNS, row)) for row in zip(*(columns[name] for name in COLUMNS))))


def decode_history(text: str, source: str) -> Rows:
    """Returns the history of results before schema version 7: a row per penalty value with that version's columns."""
    try:
        history = read_json(text)
        columns, rows = history["columns"], history["rows"]
        return Rows(columns, (dict(zip(columns, row, strict=True)) for row in rows))
    except (ValueError, KeyError, TypeError) as error:
        raise DatabaseError(f"{source}: the history cannot be read ({error}); "
                            "'legopt service doctor --db FILE' checks the database") from error
