"""Calls the program legopt for the pages of results."""
import json
import os
import shlex
import subprocess
import sys

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
LEGOPT = os.environ.get("LEGOPT", os.path.join(ROOT, "build", "legopt"))


def fail(text):
    print(f"make-results: {text}", file=sys.stderr)
    sys.exit(1)


def legopt(*arguments):
    """Returns the output of a command; ends with its message if it fails."""
    result = subprocess.run([LEGOPT, *arguments], capture_output=True, text=True)
    if result.returncode != 0:
        fail(f"legopt {shlex.join(arguments)}: {result.stderr.strip()}")
    return result.stdout


def query(database, sql):
    return [list(row.values()) for row in json.loads(legopt("query", sql, "--db", database, "--format", "json"))]
