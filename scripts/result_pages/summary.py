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
    Solved("LegOpt-best solves LegOpt's motions, all pairs of links checked", "original-rule", "LegOpt-best", "motion", START,
           "solid-statistics"),
    Solved("and those in the hard garage", "parts-solid", "LegOpt-best", "motion", START),
    Compared("LegOpt-best needs less work than SQP on LegOpt's postures, ten seeds", "ten-seeds-legopt", "SQP", "LegOpt-best",
             "work", "posture", START),
    Compared("at a lower cost", "ten-seeds-legopt", "SQP", "LegOpt-best", "cost", "posture", START),
    Compared("less work on motions in the hard garage", "ten-seeds-hard", "SQP", "LegOpt-best", "work", "motion", START),
    Compared("how many of them it solves, against SQP", "ten-seeds-hard", "SQP", "LegOpt-best", "success", "motion", START),
    Compared("At equal effort there, how many CHOMP solves, against LegOpt-best", "equal-effort", "LegOpt-best", "CHOMP", "success",
             "motion", START),
    Compared("and Adam, against LegOpt-best", "equal-effort", "LegOpt-best", "Adam", "success", "motion", START),
    Compared("I-SQP needs less work than SQP, as in the paper", "ten-seeds-legopt", "SQP", "I-SQP", "work", "posture", START),
    Compared("Does Adam solve more than SQP, as in the paper?", "ten-seeds-legopt", "SQP", "Adam", "success", "posture", START),
    Compared("Does it where hands are needed?", "contacts-postures", SQP_10, ADAM_10, "success", "posture", START),
    Compared("LegOpt-best solves more than SQP there, both with restarts", "contacts-postures", SQP_10,
             "LegOpt-best:multi_starts=10", "success", "posture", START),
    Solved("LegOpt-best without restarts solves there", "contacts-postures", "LegOpt-best", "posture", START),
    Solved("and of motions with hands", "contacts-motions", "LegOpt-best", "balanced", START),
    Solved("and of postures that are proven infeasible", "contacts-traps", "LegOpt-best, 10 restarts", "posture", START),
    Solved("The original rule accepts motions of solvers that use its pairs", "original-rule", ORIGINAL_PAIRS, "motion", START,
           "literal-statistics"),
    Solved("The solid rule, which checks all pairs, accepts of these", "original-rule", ORIGINAL_PAIRS, "motion", START,
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
    command = f"; legopt compare {shlex.join([line.a, line.b])} --family {row['family']}"
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
                 "cost, with intervals for all comparisons of a page together.")
    return "\n".join(lines) + "\n"


def replaced(text, block):
    """Returns the text of results/README.md with another first screen."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + block + END + rest.split(END)[1]
