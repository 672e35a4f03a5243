"""Results of legopt in Python: open a database read-only, get tidy rows or frames, compare methods by the program,
convert solutions for other robotics libraries. docs/reference/python.md describes all of it.

    import legopt

    with legopt.open("results.sqlite") as db:
        jobs = db.jobs().frame()
"""

from __future__ import annotations

import os

from . import orders
from .database import Database
from .errors import DatabaseError, LegoptError, MissingPackageError, ProgramError, RequestError
from .rows import Rows
from .waypoints import Waypoints

__all__ = ["Database", "DatabaseError", "LegoptError", "MissingPackageError", "ProgramError", "RequestError", "Rows",
           "Waypoints", "open", "orders"]
__version__ = "0.1.0"


def open(path: str | os.PathLike[str]) -> Database:
    """Opens the results database `path` for reading. DatabaseError if it does not exist, is not a legopt database, or
    has another version; the message has the remedy."""
    return Database(path)
