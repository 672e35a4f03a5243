"""JSON parsed as strictly as by the program: no duplicate keys in an object, no NaN, no infinite number, no unpaired
surrogate."""

from __future__ import annotations

import json
import math
import re
from typing import Any

_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def read_json(text: str | bytes) -> Any:
    """Returns the value of a JSON text. ValueError if it is not JSON, or breaks one of these rules."""
    try:
        value = json.loads(text, object_pairs_hook=_object, parse_constant=_refuse_number, parse_float=_number)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    if isinstance(text, bytes) or _SURROGATE.search(text):
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # UnicodeEncodeError is a ValueError
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in keys if keys.count(key) > 1)}' is given twice")
    return found


def _refuse_number(word: str) -> float:
    raise ValueError(f"{word} is no JSON")


def _number(word: str) -> float:
    value = float(word)
    return value if math.isfinite(value) else _refuse_number(word)
