"""Replays the sessions of docs/how-to/clusters.md."""
import doctest
import re
import subprocess

import cluster as engine
from pools import service, states
from runs import PROGRAMS, SOURCE, check_nothing_left, expect

DOCUMENT = SOURCE / "docs" / "how-to" / "clusters.md"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block):
    """Returns each command of a console block with its output."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, printed = part.partition("\n")
        yield command, printed


def same(wanted, got):
    """Compares two texts; '...' matches anything."""
    return doctest.OutputChecker().check_output(wanted, got, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)


def documented_sessions(cluster, _):
    """Policy: the output shown in docs/how-to/clusters.md is correct."""
    replayed = 0
    folder = cluster.shared / "session"  # logs are written to a folder that all nodes share
    folder.mkdir()
    with service(folder) as site:
        site.access.rename(folder / "lab.access")
        site.key.rename(folder / "lab.key")
        for kind, text in FENCE.findall(DOCUMENT.read_text(encoding="utf-8")):
            if kind == "yaml":
                (folder / "pool.yaml").write_text(text, encoding="utf-8")
                continue
            for command, printed in commands(text):
                if command.startswith("legopt pool status"):
                    engine.wait_for("both workers", lambda: states(site, "legopt-pool") == {"RUNNING": 2})
                words = [PROGRAMS / "legopt", *command.split()[1:]]
                done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
                expect(done.returncode == 0, f"{command}: {done.stderr}")
                expect(same(printed, done.stdout), f"{command} printed\n{done.stdout}instead of\n{printed}")
                replayed += 1
    expect(replayed >= 4, f"{replayed} commands in {DOCUMENT}")
    check_nothing_left(cluster)
    return f"{replayed} commands of {DOCUMENT.name} print what it says"


SCENARIOS = (documented_sessions,)
