"""Sections of the pages of results: suites, datasets and the tables that show them."""
import collections
import functools
import os
import shlex
import shutil
import subprocess

from result_pages import heads
from result_pages.program import ROOT, fail, legopt

LEVELS = [(kind, level) for kind in ("garage", "house") for level in ("easier", "easy", "intermediate", "hard")]

Section = collections.namedtuple("Section", "name title suite options data tables")


EITHER_PAIRS = ["--methods", "LegOpt-best,LegOpt-best original pairs", "--tasks", "motion", "--multi-starts", "0",
                "--collision", "solid"]
ONE_ROW = ["--methods", "LegOpt-best"]
ALL_PAIRS = ["--methods", "LegOpt-best", "--collision", "solid", "--rule", "solid"]
ONE_START = ["--multi-starts", "0", "--methods", "SQP,SGD,Adam,Nadam,CHOMP,LegOpt-best"]
RESTARTS = ["--multi-starts", "10", "--methods", "SQP,I-SQP,LegOpt-best"]
FEW_ROWS = ["--multi-starts", "0", "--methods", "SQP,CHOMP,LegOpt-best"]
FROZEN = ["HEAD"]  # commit whose test seeds are used
NO_STAIRS = ("house", "hard")  # none of them is standing


def sections():
    """Returns the sections in the order of the document. `data`: "" for the default dataset, "legopt", or the name of a
    generated one."""
    both = ("the default dataset", ""), ("LegOpt's problems", "legopt")
    for where, data in both:
        suffix = "-legopt" if data else ""
        yield Section("table1-solid" + suffix, f"Table I on {where}: obstacles as solids", "table1",
                      ["--collision", "solid"], data, ("plain", "statistics"))
        yield Section("table1-surface" + suffix, f"Table I on {where}: triangles of their own, two-sided", "table1",
                      ["--collision", "surface"], data, ("plain", "statistics"))
        yield Section("paper" + suffix, f"Table I on {where}, by the strictest reading", "paper", [], data, ("plain",))
        yield Section("legopt-best" + suffix, f"LegOpt-best on {where}", "legopt-best", [], data,
                      ("plain", "solid", "statistics"))
        yield Section("baselines" + suffix, f"Baselines on {where}", "baselines", [], data, ("plain", "statistics"))
        yield Section("fidelity" + suffix, f"Departures from the paper, on {where}", "fidelity", [], data, ("plain",))
        yield Section("ablation" + suffix, f"Ablations, on {where}", "ablation", [], data, ("plain", "statistics"))
        yield Section("sample-size" + suffix, f"The sample size, on {where}", "sample-size", [], data, ("plain",))
        yield Section("continuous" + suffix, f"Collision between waypoints, on {where}", "continuous", [], data,
                      ("plain", "interpolation"))
    for kind, level in LEVELS:
        yield Section(f"levels-{kind}-{level}", f"Generated: {kind}, {level}", "levels", [], f"{kind}-{level}",
                      ("plain",))


def best_sections():
    """LegOpt-best on all available data, and in buildings of seeds that no method was tuned on."""
    places = (("LegOpt's problems", "-legopt", "legopt"), ("the default dataset", "", ""),
              ("the hard garage", "-hard", "embedded:garage-hard"))
    for where, suffix, data in places:
        yield Section("best" + suffix, f"LegOpt-best on {where}", "legopt-best", ONE_ROW, data, ("plain",))
        yield Section("solid-rule" + suffix, f"By the solid rule, on {where}", "legopt-best", ALL_PAIRS, data, ("solid",))
        yield Section("paths" + suffix, f"Continuous motions on {where}", "paths", ONE_ROW, data, ("plain",))
    for (kind, level), seed in fresh_seeds().items():
        where = f"Generated: {kind}, {level}, seed {seed}"
        data = f"fresh:{kind}-{level}"
        yield Section(f"fresh-{kind}-{level}", where, "legopt-best", ONE_ROW, data, ("plain",))
        yield Section(f"solid-rule-{kind}-{level}", where + ", by the solid rule", "legopt-best", ALL_PAIRS, data, ("solid",))


def hard_sections():
    """All rows of the table on the hard garage."""
    for collision, obstacles in (("solid", "solids"), ("surface", "triangles of their own, two-sided")):
        yield Section(f"table1-{collision}-hard", f"Obstacles as {obstacles}", "table1", ["--collision", collision],
                      "embedded:garage-hard", ("plain", "statistics"))


def seeds_sections():
    """The best rows of the paper, and LegOpt-best, with ten seeds for each problem."""
    for where, suffix, data in (("the default dataset", "", ""), ("the hard garage", "-hard", "embedded:garage-hard"),
                                ("LegOpt's problems", "-legopt", "legopt")):
        yield Section("ten-seeds" + suffix, f"On {where}", "ten-seeds", [], data, ("seeds",))


def parts_sections():
    """LegOpt-best with parts left out, on the hard garage."""
    for collision, obstacles in (("solid", "solids"), ("surface", "triangles of their own, two-sided")):
        yield Section(f"parts-{collision}", f"Obstacles as {obstacles}", "parts", ["--collision", collision],
                      "embedded:garage-hard", ("effort",))


def equal_effort_sections():
    """All solvers with restarts until the same number of term evaluations."""
    tables = ("effort", "targets")
    yield Section("equal-effort", "On the hard garage", "equal-effort", [], "", tables)
    yield Section("equal-effort-legopt", "LegOpt's postures", "equal-effort", ["--tasks", "posture"], "legopt", tables)


def original_rule_sections():
    """Motions by the original evaluator's rule, of LegOpt-best with the pairs of links that it checks, and with all. Only
    for LegOpt's problems: that rule ignores no pair of the embedded humanoid."""
    yield Section("original-rule", "Motions on LegOpt's problems", "legopt-best", EITHER_PAIRS, "legopt",
                  ("literal-statistics", "solid-statistics", "overlaps", "literal-holding"))


def contacts_sections():
    """All methods on postures that need hands, and some on traps and on motions."""
    yield Section("contacts-postures", "Postures that need hands", "contacts", [], "", ("rows", "families"))
    yield Section("contacts-traps", "Traps, which no posture solves", "contacts", ["--methods", "SQP,I-SQP,Adam,LegOpt-best"],
                  "embedded:contacts-humanoid/traps", ("rows",))
    yield Section("contacts-motions", "Motions of the humanoid", "contacts-motions", [*ONE_ROW, "--multi-starts", "0"], "",
                  ("effort",))
    yield Section("contacts-motions-quadruped", "Motions of the quadruped", "contacts-motions", ONE_ROW,
                  "embedded:contacts-quadruped", ("effort",))


def durations_sections():
    """Motions that a robot can execute: of task timed, and those of other tasks, timed as they are."""
    yield Section("timed-quadruped", "Timed motions of the quadruped, without restarts", "timed", ONE_START, "",
                  ("rows", "limits"))
    yield Section("timed-quadruped-restarts", "Timed motions of the quadruped, with ten restarts", "timed", RESTARTS, "",
                  ("rows", "limits"))
    yield Section("timed-humanoid", "Timed motions of the humanoid with hands, without restarts", "timed", FEW_ROWS,
                  "embedded:contacts-humanoid", ("rows", "limits"))
    for where, suffix, data in (("the default dataset", "", ""), ("LegOpt's problems", "-legopt", "legopt")):
        yield Section("motions" + suffix, f"Motions on {where}, which were made without time", "quick",
                      ["--tasks", "motion", "--max-stances", "120"], data, ("rows", "durations"))


@functools.cache
def fresh_seeds():
    """Returns the seed of each kind and level of building: those of the frozen commit."""
    result = subprocess.run([os.path.join(ROOT, "scripts", "test-seeds"), FROZEN[0], str(len(LEVELS))], capture_output=True,
                            text=True, cwd=ROOT)
    if result.returncode != 0:
        fail(result.stderr.strip())
    return dict(zip(LEVELS, map(int, result.stdout.split())))


def generating(data):
    """Returns the arguments of `legopt` that make a dataset of this name."""
    fresh, kind_and_level = data.startswith("fresh:"), data.removeprefix("fresh:")
    kind, level = kind_and_level.split("-")
    seed = fresh_seeds()[kind, level] if fresh else 1
    between_floors = 4 if fresh and (kind, level) != NO_STAIRS else 0
    return ["generate", "dataset", "--kind", kind, "--level", level, "--seed", str(seed), "--same-floor", "8",
            "--different-floors", str(between_floors), "--postures", "40"]


def is_generated(data):
    return "-" in data and not data.startswith("embedded:")


def dataset_path(section, folder):
    """Returns where a dataset that is not embedded belongs; the name has the seed."""
    seed = f"-{fresh_seeds()[tuple(section.data.removeprefix('fresh:').split('-'))]}" if section.data.startswith("fresh:") else ""
    return os.path.join(folder, "datasets", section.data.replace(":", "-") + seed)


def dataset_of(section, options):
    """Returns the dataset's folder, generating it if missing. None for the default dataset."""
    if section.data == "legopt":
        return options.legopt
    if section.data.startswith("embedded:"):
        return os.path.join(ROOT, "data", section.data.removeprefix("embedded:"))
    if not section.data:
        return None
    out = dataset_path(section, options.folder)
    if not os.path.isdir(out):
        shutil.rmtree(out + ".part", ignore_errors=True)
        legopt(*generating(section.data), "--out", out + ".part")
        os.rename(out + ".part", out)
    return out


CERTIFY = ["--starts", "1000"]


def certificate_of(section, folder):
    """Returns the path of the certificate of a dataset that is not embedded; None for the others, and for tables
    that do not count certified problems."""
    counts = {"plain", "solid"} & set(section.tables)
    if not counts or not section.data or section.data.startswith("embedded:"):
        return None
    return dataset_path(section, folder) + "-certificate.json"


def certify(section, dataset, folder):
    out = certificate_of(section, folder)
    if out and not os.path.exists(out):
        os.makedirs(os.path.dirname(out), exist_ok=True)
        legopt("certify", dataset, *CERTIFY, "--out", out)


def database_of(section, folder):
    return os.path.join(folder, section.name + ".sqlite")


def shown_dataset(section):
    """Returns the dataset's folder as documents show it; LEGOPT stands for LegOpt's own data."""
    if section.data == "legopt":
        return "LEGOPT"
    return "data/" + section.data.removeprefix("embedded:") if section.data.startswith("embedded:") else "DATASET"


def run_command(section):
    """Returns the words of the command that runs the suite."""
    data = ["--dataset", shown_dataset(section)] if section.data else []
    return ["legopt", "run", section.suite, *section.options, *data]


def command_of(section):
    """Returns the commands that a reader types, one per line."""
    lines = [run_command(section)]
    if is_generated(section.data):
        lines.insert(0, ["legopt", *generating(section.data), "--out", shown_dataset(section)])
    if certificate_of(section, ""):
        lines.append(["legopt", "certify", shown_dataset(section), *CERTIFY])
    return "\n    ".join(shlex.join(line) for line in lines)


Document = collections.namedtuple("Document", "file sections head has_times")
DOCUMENTS = {"": Document("table1.md", sections, heads.HEAD, True),
             "hard": Document("garage-hard.md", hard_sections, heads.HARD_HEAD, True),
             "seeds": Document("ten-seeds.md", seeds_sections, heads.SEEDS_HEAD, False),
             "parts": Document("parts.md", parts_sections, heads.PARTS_HEAD, False),
             "original-rule": Document("original-rule.md", original_rule_sections, heads.ORIGINAL_RULE_HEAD, False),
             "contacts": Document("contacts.md", contacts_sections, heads.CONTACTS_HEAD, False),
             "equal-effort": Document("equal-effort.md", equal_effort_sections, heads.EQUAL_EFFORT_HEAD, False),
             "durations": Document("durations.md", durations_sections, heads.DURATIONS_HEAD, False),
             "best": Document("legopt-best.md", best_sections, heads.BEST_HEAD, True)}
