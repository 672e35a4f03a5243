"""What can go wrong. Each text names the thing, what is wrong with it and how to set it right."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class LegoptError(Exception):
    """All of them."""


class DatabaseError(LegoptError):
    """The file cannot be read: missing, not of legopt, of another version, damaged or in the way of another program."""


class RequestError(LegoptError, ValueError):
    """What was asked for is not there or cannot be: a job, a method, a rule, a joint, a column, an SQL statement."""


class ProgramError(LegoptError):
    """The program `legopt` is not there or refused. `exit_code`: its exit code, None where it did not run."""

    def __init__(self, message: str, exit_code: int | None = None):
        super().__init__(message)
        self.exit_code = exit_code


class MissingPackageError(LegoptError, ImportError):
    """A Python package that legopt does without until it is asked for."""


def suggest(word: object, valid: Iterable[object]) -> str:
    """ "did you mean 'X'? valid: A, B" for the end of an error; without the guess where nothing is close."""
    names = [str(name) for name in valid]
    close = difflib.get_close_matches(str(word).lower(), [name.lower() for name in names], n=1)
    guess = next((name for name in names if close and name.lower() == close[0]), None)
    return (f"did you mean '{guess}'? " if guess else "") + "valid: " + (", ".join(names) or "none")
