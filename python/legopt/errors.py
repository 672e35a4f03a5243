"""Exceptions. Each message names the object, the error and a remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class LegoptError(Exception):
    """Base class of all exceptions."""


class DatabaseError(LegoptError):
    """The file cannot be read: missing, not of legopt, of another version, damaged or blocked by another program."""


class RequestError(LegoptError, ValueError):
    """The requested object does not exist or is invalid: a job, a method, a rule, a joint, a column, an SQL
    statement."""


class ProgramError(LegoptError):
    """The program `legopt` is missing or refused. `exit_code`: its exit code, None if it did not run."""

    def __init__(self, message: str, exit_code: int | None = None):
        super().__init__(message)
        self.exit_code = exit_code


class MissingPackageError(LegoptError, ImportError):
    """An optional Python package is required for this call."""


def suggest(word: object, valid: Iterable[object]) -> str:
    """Returns "did you mean 'X'? valid: A, B" for the end of an error message; without a guess if none is close."""
    names = [str(name) for name in valid]
    close = difflib.get_close_matches(str(word).lower(), [name.lower() for name in names], n=1)
    guess = next((name for name in names if close and name.lower() == close[0]), None)
    return (f"did you mean '{guess}'? " if guess else "") + "valid: " + (", ".join(names) or "none")
