"""The first screen of results/README.md: claims with figure, interval, n and command, from the CSV files of the pages."""
import collections
import csv
import os
import re
import shlex

from result_pages.sections import DOCUMENTS, command_of
from result_pages.tables import row_label

BEGIN, END = "<!-- made by scripts/make-results: begin -->\n", "<!-- made by scripts/make-results: end -->\n"
BUILD = re.compile(r"\b[Bb]uild `?([0-9a-f]{12})\b")
COLUMNS = ["claim", "task and start", "figure", "95 % interval", "n", "command"]

# A line about how many problems one row solves; `row` is the label of results pages.
Solved = collections.namedtuple("Solved", "claim section row task start table", defaults=("statistics",))
# A line about two rows: a claim of result_pages/claims.py, found by A, B and the figure.
Compared = collections.namedtuple("Compared", "claim section a b figure task start")

START = "in_collision"  # all claims are about these starts, the harder ones
ORIGINAL_PAIRS = "LegOpt-best original pairs"
SQP_10, ADAM_10 = "SQP:multi_starts=10,sample_size=100", "Adam:multi_starts=10,sample_size=100"
HEADLINES = [
    Solved("LegOpt-best solves LegOpt's motions, all pairs of links checked", "original-rule", "LegOpt-best", "motion",
           START, "solid-statistics"),
    Solved("and those in the hard garage", "parts-solid", "LegOpt-best", "motion", START),
    Compared("There, SQP with ten restarts against LegOpt-best", "parts-solid", "LegOpt-best", "SQP:multi_starts=10",
             "success", "motion", START),
    Compared("the same: work", "parts-solid", "LegOpt-best", "SQP:multi_starts=10", "work", "motion", START),
    Compared("the same: cost", "parts-solid", "LegOpt-best", "SQP:multi_starts=10", "cost", "motion", START),
    Compared("CHOMP against LegOpt-best, at equal effort", "equal-effort", "LegOpt-best", "CHOMP", "success", "motion", START),
    Compared("Adam against LegOpt-best, at equal effort", "equal-effort", "LegOpt-best", "Adam", "success", "motion", START),
    Compared("LegOpt-best without waypoints solved alone", "parts-solid", "LegOpt-best", "without waypoints alone", "success",
             "motion", START),
    Compared("LegOpt-best with a small trust box", "parts-solid", "LegOpt-best", "small box", "work", "motion", START),
    Solved("Where hands are needed, SQP with ten restarts solves", "contacts-postures", "SQP, 10 restarts", "posture", START),
    Solved("LegOpt-best without restarts", "contacts-postures", "LegOpt-best", "posture", START),
    Compared("The paper: I-SQP needs less work than SQP", "contacts-postures", SQP_10, "I-SQP", "work", "posture", START),
    Compared("The paper: Adam solves more than SQP", "contacts-postures", SQP_10, ADAM_10, "success", "posture", START),
    Solved("Motions with hands that LegOpt-best solves", "contacts-motions", "LegOpt-best", "balanced", START),
    Solved("Postures proven infeasible that it \"solves\"", "contacts-traps", "LegOpt-best, 10 restarts", "posture", START),
    Solved("LegOpt's motions that the original rule accepts, with its pairs of links", "original-rule", ORIGINAL_PAIRS,
           "motion", START, "literal-statistics"),
    Solved("Those that the solid rule accepts, with all pairs", "original-rule", ORIGINAL_PAIRS, "motion", START,
           "solid-statistics"),
]


def rows_of(results, section, kind):
    with open(os.path.join(results, "tables", f"{section}-{kind}.csv"), encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def only(rows, line):
    if len(rows) != 1:
        raise LookupError(f"{line.section}: {len(rows)} rows of its CSV files fit the claim '{line.claim}', not one")
    return rows[0]


def in_cell(row, line):
    return row["task"] == line.task and row["initialization"] == line.start


def label_of(row):
    return row_label(row | {name: int(row[name]) for name in ("multi_starts", "sample_size")})


def solved_cells(results, line):
    row = only([row for row in rows_of(results, line.section, line.table)
                if in_cell(row, line) and label_of(row) == line.row], line)
    interval = f"[{100 * float(row['share_lower']):.1f}, {100 * float(row['share_upper']):.1f}] %"
    share = 100 * float(row["solved"]) / int(row["n"])
    return f"{share:.1f} % solved", interval, row["n"], ""


def compared_cells(results, line):
    row = only([row for row in rows_of(results, line.section, "claims")
                if in_cell(row, line) and (row["a"], row["b"], row["figure"]) == (line.a, line.b, line.figure)], line)
    scale, unit = (100, " %") if line.figure == "success" else (1, "")

    def number(field):
        return f"{scale * float(row[field]):.3g}" if row[field] else "-"

    meaning = f"{number('value')} percentage points" if line.figure == "success" else f"{line.figure} x {number('value')}"
    change = {"none": "no difference shown"}.get(row["reads"], row["reads"])
    command = f"; legopt compare {shlex.join([line.a, line.b])}"
    return f"{meaning}: {change}", f"[{number('lower')}, {number('upper')}]{unit}", row["pairs"], command


def page_and_command():
    """Returns, by name of a section, its page and the command that runs it."""
    return {section.name: (document.file, command_of(section).split("\n")[-1].strip())
            for document in DOCUMENTS.values() for section in document.sections()}


def summary(results):
    """Returns the text of the first screen for the CSV files of a folder; LookupError or OSError if one lacks a claim."""
    of_section = page_and_command()
    lines = ["| " + " | ".join(COLUMNS) + " |", "| --- |" + " --- |" * (len(COLUMNS) - 1)]
    pages = {}
    for line in HEADLINES:
        page, command = of_section[line.section]
        pages[page] = None
        cells = solved_cells(results, line) if isinstance(line, Solved) else compared_cells(results, line)
        figure, interval, n, more = cells
        lines.append(f"| [{line.claim}]({page}) | {line.task}, {line.start.replace('_', ' ')} | {figure} | {interval} | {n} | "
                     f"`{command}{more}` |")
    builds = set()
    for page in pages:
        with open(os.path.join(results, page), encoding="utf-8") as file:
            builds |= set(BUILD.findall(file.read()))
    lines.append("")
    lines.append(f"From build {' and build '.join(sorted(builds))}. Comparisons are B - A for success and B / A for work and "
                 "cost, with intervals of a whole page's comparisons.")
    return "\n".join(lines) + "\n"


def replaced(text, block):
    """Returns the text of results/README.md with another first screen."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + block + END + rest.split(END)[1]
