"""Results of legopt in Python: open a database read-only, take tidy rows or frames, ask the program for comparisons,
hand solutions to other robotics libraries. docs/python.md shows all of it.

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
    """The results database `path`, for reading. DatabaseError: there is none, it is none of legopt, or of another
    version; the text says what to do."""
    return Database(path)
