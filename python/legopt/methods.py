"""Methods of an experiment, and names that distinguish them: "SQP", and for several methods of a name
"SQP:multi_starts=10", as `legopt compare` accepts and prints them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .errors import RequestError, suggest
from .read_only_file import ReadOnlyFile
from .rows import Rows

Method = dict[str, Any]


def read_methods(file: ReadOnlyFile, experiment: int) -> Rows:
    """Returns the methods of an experiment, in the order of its table: `choice` is the shortest unique name."""
    found = file.select(
        "SELECT m.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, m.hash "
        "FROM methods AS m JOIN cells AS c USING (method_id) WHERE c.experiment_id = ? GROUP BY m.method_id "
        "ORDER BY min(c.cell_id)", [experiment])
    for method in found:
        method["incremental"] = bool(method["incremental"])
    columns = ["experiment_id", "method_id", "choice", *found.columns[1:]]
    told = ({"experiment_id": experiment, "choice": _choice_of(method, found), **method} for method in found)
    return Rows(columns, ({name: method[name] for name in columns} for method in told))


def _figures_of(method: Method) -> dict[str, str]:
    """Returns the options that distinguish methods of one name, with the number as the last resort."""
    return {"multi_starts": str(method["multi_starts"]), "sample_size": str(method["sample_size"]),
            "incremental": "yes" if method["incremental"] else "no", "collision": method["collision"],
            "id": str(method["method_id"])}


def _choice_of(method: Method, methods: Sequence[Method]) -> str:
    rivals = _of_name(method["method"], methods)
    told = []
    for key, value in _figures_of(method).items():
        if len(rivals) < 2:
            break
        left = [rival for rival in rivals if _figures_of(rival)[key] == value]
        if len(left) < len(rivals):
            told.append(f"{key}={value}")
        rivals = left
    return method["method"] + (":" + ",".join(told) if told else "")


def _of_name(name: str, methods: Sequence[Method]) -> list[Method]:
    return [method for method in methods if method["method"].lower() == name.lower()]


def find_method(text: str, methods: Sequence[Method]) -> Method | None:
    """Returns the method that `text` names, ignoring case; None if no method has this name. RequestError if several
    have it, or none of this name has such options."""
    found = _of_name(text, methods)  # a name may contain a colon itself
    if not found and ":" in text:
        name, _, figures = text.rpartition(":")
        named = _of_name(name, methods)
        if not named:
            return None
        wanted = _read_figures(text, figures)
        found = [method for method in named
                 if all(_figures_of(method)[key].lower() == value.lower() for key, value in wanted.items())]
        if not found:
            raise RequestError(f"no '{name}' is like '{text}'; there is {_choices(named)}")
    if len(found) > 1:
        raise RequestError(f"'{text}' names {len(found)} methods; say which: {_choices(found)}")
    return found[0] if found else None


def choose_method(text: str, methods: Sequence[Method], experiment: int) -> Method:
    """Returns the method that `text` names; RequestError as well if there is none."""
    found = find_method(text, methods)
    if found is None:
        raise RequestError(f"experiment {experiment} has no method '{text}'; "
                           f"{suggest(text, [method['choice'] for method in methods])}")
    return found


def _read_figures(text: str, figures: str) -> dict[str, str]:
    keys = ["multi_starts", "sample_size", "incremental", "collision", "id"]
    wanted = {}
    for figure in figures.split(","):
        key, equals, value = figure.partition("=")
        if not equals:
            raise RequestError(f"'{text}': '{figure}' is no figure of a method; write it as NAME:multi_starts=10")
        if key not in keys:
            raise RequestError(f"'{text}': '{key}' tells no methods apart; {suggest(key, keys)}")
        wanted[key] = value
    return wanted


def _choices(methods: Sequence[Method]) -> str:
    return ", ".join(f"'{method['choice']}'" for method in methods)
