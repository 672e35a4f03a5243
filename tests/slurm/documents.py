"""The sessions of docs/clusters.md, replayed."""
import doctest
import re
import subprocess

import cluster as engine
from pools import service, states
from runs import PROGRAMS, SOURCE, check_nothing_left, expect

DOCUMENT = SOURCE / "docs" / "clusters.md"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block):
    """Of a console: each command and what it prints."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, printed = part.partition("\n")
        yield command, printed


def same(wanted, got):
    """'...' stands for anything."""
    return doctest.OutputChecker().check_output(wanted, got, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)


def documented_sessions(cluster, _):
    """Policy: what docs/clusters.md shows is what is printed."""
    replayed = 0
    folder = cluster.shared / "session"  # logs come where all nodes write
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
