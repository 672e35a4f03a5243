"""The first screen of results/README.md: claims with figure, interval, n and command, from the CSV files of the pages."""
import collections
import csv
import os
import re
import shlex

from result_pages.sections import DOCUMENTS, run_command
from result_pages.tables import OPTIONS, interval_text, row_label

BEGIN, END = "<!-- made by scripts/make-results: begin -->\n", "<!-- made by scripts/make-results: end -->\n"
BUILD = re.compile(r"\b[Bb]uild `?([0-9a-f]{12})\b")
COLUMNS = ["claim", "task and start", "figure", "95 % interval", "n", "command"]

# A claim about how many problems one row solves; `row` is the label of results pages.
Solved = collections.namedtuple("Solved", "claim section row task start table", defaults=("statistics",))
# A claim about two rows: one of result_pages/claims.py, found by A, B and the figure.
Compared = collections.namedtuple("Compared", "claim section a b figure task start")

GOOD, IN_COLLISION = "good", "in_collision"
ORIGINAL_PAIRS = "LegOpt-best original pairs"
SQP_10, ADAM_10 = "SQP:multi_starts=10,sample_size=100", "Adam:multi_starts=10,sample_size=100"
HEADLINES = [
    Solved("LegOpt-best solves LegOpt's motions", "original-rule", "LegOpt-best", "motion", IN_COLLISION, "solid-statistics"),
    Solved("LegOpt-best solves motions in the hard garage, obstacles as solids", "parts-solid", "LegOpt-best", "motion",
           IN_COLLISION),
    Solved("LegOpt-best solves motions there, obstacles as triangles", "parts-surface", "LegOpt-best, surface", "motion",
           IN_COLLISION),
    Solved("SQP with 40 restarts solves motions there, obstacles as triangles", "parts-surface", "SQP, 40 restarts, surface",
           "motion", IN_COLLISION),
    Compared("LegOpt-best needs less work than SQP on LegOpt's postures", "ten-seeds-legopt", "SQP", "LegOpt-best", "work",
             "posture", IN_COLLISION),
    Compared("Its cost is lower there than SQP's", "ten-seeds-legopt", "SQP", "LegOpt-best", "cost", "posture", IN_COLLISION),
    Compared("LegOpt-best needs less work than I-SQP there", "ten-seeds-legopt", "I-SQP", "LegOpt-best", "work", "posture",
             IN_COLLISION),
    Compared("I-SQP needs less work than SQP there, as in the paper", "ten-seeds-legopt", "SQP", "I-SQP", "work", "posture",
             IN_COLLISION),
    Compared("LegOpt-best needs less work than SQP in the hard garage, motions of at most 80 stances", "ten-seeds-hard", "SQP",
             "LegOpt-best", "work", "motion", IN_COLLISION),
    Compared("Adam solves more of these than SQP, as in the paper", "ten-seeds-hard", "SQP", "Adam", "success", "motion",
             IN_COLLISION),
    Compared("At equal effort SQP solves fewer motions of the hard garage than LegOpt-best", "equal-effort", "LegOpt-best", "SQP",
             "success", "motion", IN_COLLISION),
    Compared("At equal effort Adam solves fewer of them than LegOpt-best", "equal-effort", "LegOpt-best", "Adam", "success",
             "motion", IN_COLLISION),
    Compared("With hands, Adam solves more postures than SQP, ten restarts each", "contacts-postures", SQP_10, ADAM_10,
             "success", "posture", IN_COLLISION),
    Compared("The same from good starts", "contacts-postures", SQP_10, ADAM_10, "success", "posture", GOOD),
    Compared("With hands, LegOpt-best solves more postures than SQP, ten restarts each", "contacts-postures", SQP_10,
             "LegOpt-best:multi_starts=10", "success", "posture", IN_COLLISION),
    Solved("LegOpt-best solves motions with hands", "contacts-motions", "LegOpt-best", "balanced", IN_COLLISION),
    Solved("LegOpt-best \"solves\" postures that are proven infeasible", "contacts-traps", "LegOpt-best, 10 restarts",
           "posture", IN_COLLISION),
    Solved("The original rule accepts LegOpt-best's motions with that rule's pairs of links", "original-rule", ORIGINAL_PAIRS,
           "motion", IN_COLLISION, "literal-statistics"),
    Solved("The solid rule, which checks all pairs, accepts the same motions", "original-rule", ORIGINAL_PAIRS, "motion",
           IN_COLLISION, "solid-statistics"),
]
NOTES = """A line states a claim; *figure* says what was found, and for comparisons whether it was shown. LegOpt-best restarts inside an
attempt; with hands it has other options than SQP ([contacts](contacts.md)). Defaults were chosen on LegOpt's problems and
the embedded datasets ([what was tuned on what](../docs/explanation/fidelity.md#what-has-been-tuned-on-what)). LEGOPT is
the folder of LegOpt's own data. Comparisons are B - A for success and B / A for work and cost. Their intervals hold for all
comparisons of a page together, the others for one row. "-": all pairs have the same value, which resampling cannot bound.
"""


def rows_of(results, section, kind):
    with open(os.path.join(results, "tables", f"{section}-{kind}.csv"), encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def single_row(rows, line, fits):
    """Returns the row of the task and start of a claim for which fits(row) is true; LookupError unless there is one."""
    found = [row for row in rows if (row["task"], row["initialization"]) == (line.task, line.start) and fits(row)]
    if len(found) != 1:
        raise LookupError(f"{line.section}: {len(found)} rows of its CSV files fit the claim '{line.claim}', not one")
    return found[0]


def label_of(row):
    return row_label(row | {name: int(row[name]) for name in ("multi_starts", "sample_size")})


def solved_cells(results, line):
    """Returns figure, interval, n, and the command after the run."""
    row = single_row(rows_of(results, line.section, line.table), line, lambda row: label_of(row) == line.row)
    if not int(row["n"]) or not row["share_lower"]:
        raise LookupError(f"{line.section}: no problem was finished by all rows, for the claim '{line.claim}'")
    share = 100 * float(row["solved"]) / int(row["n"])
    interval = interval_text(100 * float(row["share_lower"]), 100 * float(row["share_upper"]))
    return f"{share:.3g} % solved", f"{interval} %", row["n"], ["legopt", "table", *OPTIONS[line.table]]


def compared_cells(results, line):
    """Returns figure, interval, n, and the command after the run."""
    row = single_row(rows_of(results, line.section, "claims"), line,
                     lambda row: (row["a"], row["b"], row["figure"]) == (line.a, line.b, line.figure))
    scale, unit = (100, " %") if line.figure == "success" else (1, "")
    value, lower, upper = (scale * float(row[name]) if row[name] else None for name in ("value", "lower", "upper"))
    if value is None:
        raise LookupError(f"{line.section}: no pair has a value for the claim '{line.claim}'")
    found = f"{value:.3g} percentage points" if line.figure == "success" else f"{line.figure} x {value:.3g}"
    change = {"none": "no difference shown"}.get(row["reads"], row["reads"])
    interval = interval_text(lower, upper)
    command = ["legopt", "compare", line.a, line.b, "--family", row["family"]]
    return f"{found}: {change}", interval + ("" if interval == "-" else unit), row["pairs"], command


def pages_of(names):
    """Returns, by name of a section, its page and the section. Sections of generated buildings need Git, and come last."""
    found = {}
    for document in DOCUMENTS.values():
        for section in document.sections():
            if section.name in names:
                found[section.name] = document.file, section
            if len(found) == len(names):
                return found
    raise LookupError(f"no section {', '.join(sorted(names - set(found)))}")


def summary(results):
    """Returns the text of the first screen for the CSV files of a folder; LookupError or OSError if one lacks a claim."""
    sections = pages_of({line.section for line in HEADLINES})
    lines = ["| " + " | ".join(COLUMNS) + " |", "| --- |" + " --- |" * (len(COLUMNS) - 1)]
    for line in HEADLINES:
        page, section = sections[line.section]
        cells = solved_cells(results, line) if isinstance(line, Solved) else compared_cells(results, line)
        figure, interval, n, after = cells
        database = ["--db", section.name + ".sqlite"]
        command = f"{shlex.join(run_command(section) + database)}; {shlex.join(after + database)}"
        lines.append(f"| [{line.claim}]({page}) | {line.task}, {line.start.replace('_', ' ')} | {figure} | {interval} | {n} | "
                     f"`{command}` |")
    builds = set()
    for page, _ in sections.values():
        with open(os.path.join(results, page), encoding="utf-8") as file:
            builds |= set(BUILD.findall(file.read()))
    return "\n".join(lines) + f"\n\nFrom build {' and build '.join(sorted(builds))}.\n{NOTES}"


def replaced(text, block):
    """Returns the text of results/README.md with another first screen; LookupError if it has no place for it."""
    if BEGIN not in text or END not in text:
        raise LookupError(f"README.md lacks the lines {BEGIN.strip()} and {END.strip()}")
    before, rest = text.split(BEGIN, 1)
    return before + BEGIN + block + END + rest.split(END, 1)[1]
