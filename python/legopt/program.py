"""The program `legopt`, which computes all statistics, so that there is one implementation."""

from __future__ import annotations

import os
import shutil
import subprocess

from .errors import ProgramError

VARIABLE = "LEGOPT"


def find_program(program: str | os.PathLike[str] | None = None) -> str:
    """Returns its path: `program`, else the environment variable LEGOPT, else the one on the PATH. ProgramError if
    there is none."""
    wanted = program or os.environ.get(VARIABLE)
    found = shutil.which(os.fspath(wanted)) if wanted else shutil.which("legopt")
    if found is None:
        what = f"'{os.fspath(wanted)}' is no program" if wanted else "the program legopt is not on the PATH"
        raise ProgramError(f"{what}; install legopt, or name it: program='build/legopt', or {VARIABLE}=build/legopt in "
                           "the environment")
    return os.path.abspath(found)


def run_program(arguments: list[str], program: str | os.PathLike[str] | None = None) -> str:
    """Returns the output of `legopt ARGUMENTS`. ProgramError with its exit code and error message if it refused."""
    path = find_program(program)
    try:
        # Runs in another folder: `compare` would prefer a file of the current folder to a method of this name.
        done = subprocess.run([path, *arguments], cwd="/", stdin=subprocess.DEVNULL, capture_output=True, check=False)
    except OSError as error:
        raise ProgramError(f"{path} cannot be run: {error.strerror}; is it the program of this machine?") from error
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip() or f"legopt ended with exit code {done.returncode}"
        raise ProgramError(said, done.returncode)
    return done.stdout.decode("utf-8")
