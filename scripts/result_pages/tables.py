"""Tables of the pages of results, as Markdown and CSV."""
import collections
import csv
import functools
import io
import json
import os
import statistics

from result_pages.claims import CLAIMS, CLAIMS_OF
from result_pages.program import ROOT, fail, legopt, query
from result_pages.sections import database_of

EFFORT_COLUMNS = ["method", "multi_starts", "solved", "interval", "work_median", "work_ratio", "cost_median", "cost_ratio",
                  "tolerance_median", "tolerance_largest", "further_starts_mean", "further_starts_largest"]
ROWS_COLUMNS = [*EFFORT_COLUMNS[:2], "sample_size", *EFFORT_COLUMNS[2:]]
SEEDS_COLUMNS = [*EFFORT_COLUMNS[:4], "seeds", *EFFORT_COLUMNS[4:]]


def method_label(with_collision=False):
    """Returns the SQL expression of a row's label. `with_collision`: other models than solids are named."""
    text = ("method || CASE WHEN multi_starts > 0 THEN ', ' || multi_starts || ' restarts' ELSE '' END || "
            "CASE WHEN sample_size < 100 THEN ', ' || sample_size || ' %' ELSE '' END")
    return text + (" || CASE WHEN collision <> 'solid' THEN ', ' || collision ELSE '' END" if with_collision else "")


def row_label(row):
    """Returns the label of a row of a table, as method_label(with_collision=True)."""
    text = row["method"]
    if row["multi_starts"] > 0:
        text += f", {row['multi_starts']} restarts"
    if row["sample_size"] < 100:
        text += f", {row['sample_size']} %"
    return text + (f", {row['collision']}" if row["collision"] != "solid" else "")


def failure_table(database, rule):
    """Returns the failures by a rule, by method and cell: the number for each reason, and the progress of motions."""
    rows = query(database, f"SELECT {method_label()} AS row, collision, task, initialization, "
                           f"coalesce(verdict_{rule}, state) AS reason, windows_solved, windows FROM job_list "
                           f"WHERE state IN ('failed', 'dead') OR verdict_{rule} <> 'success' ORDER BY job_id")
    cells = collections.OrderedDict()
    collisions = {row[1] for row in rows}
    for row, collision, task, start, reason, solved, windows in rows:
        row += f", {collision}" if len(collisions) > 1 else ""
        place = f"{task}, {start.replace('_', ' ')}"
        # The windows after an unsolved one were not tried.
        stopped = reason in ("window_unsolved", "wrong_waypoint_count") and windows  # the second: before schema 11
        reasons = cells.setdefault(row, {}).setdefault(place, {})
        reasons.setdefault("no solution of a window" if stopped else reason.replace("_", " "), []).append(
            100 * solved / windows if stopped else None)
    if not cells:
        return "Nothing failed.\n"

    def words(reason, shares):
        text = f"{len(shares)} {reason}"
        return text if shares[0] is None else f"{text}, after {statistics.median(shares):.0f} %"

    tasks = ("posture", "motion", "continuous", "balanced", "timed")
    places = [place for place in (f"{task}, {start}" for task in tasks for start in ("good", "in collision"))
              if any(place in row for row in cells.values())]
    lines = ["| method | " + " | ".join(places) + " |", "| --- |" + " --- |" * len(places)]
    for row, of_row in cells.items():
        reasons = ["; ".join(words(*item) for item in sorted(of_row.get(place, {}).items(), key=lambda x: -len(x[1])))
                   for place in places]
        lines.append(f"| {row} | " + " | ".join(text or "-" for text in reasons) + " |")
    return ("Unsolved jobs, by the first check that failed. For motions: the median share of windows that were solved before "
            "it.\n\n" + "\n".join(lines) + "\n")


@functools.cache
def methods_of(database):
    return query(database, "SELECT DISTINCT method, multi_starts, sample_size FROM job_list")


def has_row(database, row):
    """Returns whether a row like "SQP:multi_starts=10" is in a database."""
    name, _, options = row.partition(":")
    wanted = {key: int(value) for key, value in (option.split("=") for option in options.split(",") if option)}
    return any(method == name and wanted.items() <= {"multi_starts": starts, "sample_size": sample}.items()
               for method, starts, sample in methods_of(database))


@functools.cache
def comparisons(database, a, b, family):
    """Returns the comparisons of B with A, as one of `family` tests; none if a row is missing."""
    if not has_row(database, a) or not has_row(database, b):
        return []
    return json.loads(legopt("compare", a, b, "--db", database, "--format", "json", "--family", str(family)))["comparisons"]


def claims_of(section):
    return CLAIMS_OF.get(section.name) or CLAIMS_OF.get(section.suite, [])


def num_claims(section, folder):
    """Returns the number of rows of a section's table of claims."""
    return sum(len(comparisons(database_of(section, folder), a, b, 1)) for _, a, b, _ in claims_of(section))


CLAIM_FIELDS = ["claim", "a", "b", "figure", "task", "initialization", "pairs", "value", "lower", "upper", "adjusted_p",
                "reads", "family"]


def claim_rows(database, claims, family):
    """Returns claims about rows as dictionaries of CLAIM_FIELDS: n, the figure, its interval and the result of the test,
    which is one of `family`."""
    rows = []
    for claim, a, b, figure in claims:
        for pair in comparisons(database, a, b, family):
            part = pair[figure]
            lower, upper = part["interval"] or [None, None]
            rows.append({"claim": claim, "a": a, "b": b, "figure": figure, "task": pair["task"],
                         "initialization": pair["initialization"], "pairs": pair["pairs"],
                         "value": part["difference"] if figure == "success" else part["ratio"], "lower": lower,
                         "upper": upper, "adjusted_p": part["adjusted_p"], "reads": part["change"], "family": family})
    return rows


def interval_text(lower, upper, digits=3):
    """Returns an interval; "-" if there is none, or if all pairs have the same value: resampling cannot bound that."""
    if lower is None or upper is None or lower == upper:
        return "-"
    return f"[{lower:.{digits}g}, {upper:.{digits}g}]"


def claims_table(rows):
    """Returns the table of claims; empty without any."""
    head = ["| claim | task and start | pairs | figure | interval | p, adjusted | reads |",
            "| --- | --- | ---: | ---: | --- | ---: | --- |"]

    def number(value):
        return "-" if value is None else f"{value:.3g}"

    lines = [f"| {row['claim']} | {row['task']}, {row['initialization'].replace('_', ' ')} | {row['pairs']} | "
             f"{number(row['value'])} | {interval_text(row['lower'], row['upper'])} | {number(row['adjusted_p'])} | "
             f"{row['reads']} |" for row in rows]
    return "\n".join(head + lines) + "\n" if lines else ""


def solved_by_family(database):
    """Returns rows of strings: the numbers of solved problems of each family of the embedded dataset, by method."""
    with open(os.path.join(ROOT, "data", "contacts-humanoid", "features.csv"), encoding="utf-8", newline="") as file:
        family_of = {int(row["id"]): row["family"] for row in csv.DictReader(file)}
    jobs = query(database, f"SELECT {method_label()} AS label, initialization, problem_id, "
                           f"verdict_{rule_of(database)} = 'success' FROM job_list ORDER BY job_id")
    places = [(family, start) for family in dict.fromkeys(family_of.values()) for start in ("good", "in_collision")]
    solved, asked = collections.Counter(), collections.Counter()
    methods = {}
    for row, start, problem, success in jobs:
        place = family_of[problem], start
        methods[row] = None
        asked[row, place] += 1
        solved[row, place] += success or 0
    head = ["method", *(f"{family}, {start.replace('_', ' ')}" for family, start in places)]
    return [head, *([row, *(f"{solved[row, place]}/{asked[row, place]}" for place in places)] for row in methods)]


def overlapping_pairs(database):
    """Returns rows of strings: for each method, the pairs of links that overlap deepest in solutions that only the original
    rule accepts, and the number of those solutions."""
    rows = query(database, "SELECT method, subject, count(*) AS jobs, max(value) AS depth_m FROM violations JOIN job_list "
                           "USING (job_id) WHERE check_name = 'self_collision' AND rule = 'solid' AND verdict_literal = "
                           "'success' AND verdict_solid <> 'success' GROUP BY method, subject ORDER BY method, jobs DESC")
    return [["method", "deepest pair", "solutions", "deepest (mm)"],
            *([method, subject, str(jobs), f"{1000 * depth_m:.1f}"] for method, subject, jobs, depth_m in rows)]


def limits_of_motions(database):
    """Returns rows of strings: durations of the timed motions that each method solved from each start, and what limits
    them."""
    columns = ("initialization, cost, reduced_duration_s, duration_s, velocity_limited_share, torque_limited_share, "
               "contact_limited_share")
    jobs = query(database, f"SELECT {method_label()} AS label, {columns}, verdict_{rule_of(database)} = 'success' FROM job_list "
                           "ORDER BY job_id")
    groups = collections.OrderedDict()
    for label, start, *values, success in jobs:
        of_group = groups.setdefault((label, start.replace("_", " ")), [])
        if success:
            of_group.append(values)

    def number(values, digits):
        return f"{statistics.median(values):.{digits}f}" if values else "-"

    rows = [["method", "start", "solved", "s per stance", "at 80 %", "T* at 80 % / T*", "velocity", "torque", "contact"]]
    for (label, start), motions in groups.items():
        costs, reduced, durations, *shares = zip(*motions) if motions else [()] * 6
        ratios = [slow / fast for slow, fast in zip(reduced, durations) if slow is not None]
        rows.append([label, start, str(len(motions)), number(costs, 3), str(len(ratios)), number(ratios, 2),
                     *(number(share, 2) for share in shares)])
    return rows


DURATION_COLUMNS = {"method": "method", "motions": "motions", "executable": "executable", "median_s_per_stance": "s per stance",
                    "median_greedy_ratio": "greedy / T*", "executable_reduced": "at 80 %",
                    "median_reduced_ratio": "T* at 80 % / T*"}


@functools.cache
def durations_file(database):
    """Returns the file of the durations of a database; its name has the build that made the motions."""
    build = query(database, "SELECT max(build_id) FROM result_origins")[0][0]
    return f"{database.removesuffix('.sqlite')}-durations-{build}.csv"


def write_durations(database, dataset):
    """Computes the durations of all motions of a database, unless its file is newer. `dataset`: None for the default one."""
    path = durations_file(database)
    if os.path.exists(path) and os.path.getmtime(path) >= os.path.getmtime(database):
        return
    solutions = database.removesuffix(".sqlite") + "-solutions.json"
    legopt("export", "--db", database, "--out", solutions)
    data = ["--dataset", dataset] if dataset else []
    text = legopt("evaluate", solutions, "--durations", "methods", "--format", "csv", *data)
    os.remove(solutions)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def durations_of_motions(database):
    """Returns rows of strings of the file of write_durations()."""
    if not os.path.exists(durations_file(database)):
        fail(f"there is no {durations_file(database)}; run this again without --render")
    with open(durations_file(database), encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [list(DURATION_COLUMNS.values()), *([shortened(row[name]) for name in DURATION_COLUMNS] for row in rows)]


def shortened(text):
    """Returns a number with three digits; other texts unchanged."""
    return f"{float(text):.3g}" if "." in text and text.replace(".", "").isdigit() else text or "-"


def markdown_of(rows, title):
    """Returns a table of strings; columns beyond the first are aligned to the right."""
    head, *rest = rows
    lines = ["| " + " | ".join(row) + " |" for row in (head, *rest)]
    lines.insert(1, "| --- |" + " ---: |" * (len(head) - 1))
    return f"{title}:\n\n" + "\n".join(lines) + "\n"


# Tables that no command of legopt prints: title and rows.
OWN_TABLES = {"limits": ("Solved motions: medians of duration, and shares of it in which velocity, torque or a contact's force "
                         "is nearest its limit", limits_of_motions),
              "durations": ("Durations", durations_of_motions),
              "families": ("Solved by family", solved_by_family),
              "overlaps": ("Pairs of links that overlap deepest in motions that only the original rule accepts, from both starts",
                           overlapping_pairs)}


def experiment_facts(database):
    """Returns facts of the only experiment of a database; tables and figures count all its jobs."""
    experiments = query(database, "SELECT name, seed, num_jobs, state, date(finished_at_us / 1000000, 'unixepoch') FROM "
                                  "experiments")
    if len(experiments) != 1:
        fail(f"{database} has {len(experiments)} experiments, not one; use another folder")
    name, seed, jobs, state, finished = experiments[0]
    return {"name": name, "seed": seed, "jobs": jobs, "state": state, "date": finished}


def rule_of(database):
    return query(database, "SELECT coalesce(json_extract(spec_json, '$.rule'), 'solid') FROM experiments "
                           "ORDER BY experiment_id DESC LIMIT 1")[0][0]


# Options of `legopt table` for each kind of table, and the columns of its Markdown form; none = all.
OPTIONS = {"plain": [], "solid": ["--rule", "solid"], "interpolation": ["--interpolation"],
           "targets": ["--targets", "1.01,1.1,2"], "statistics": ["--statistics"], "effort": ["--statistics"],
           "rows": ["--statistics"], "seeds": ["--statistics"],
           "solid-statistics": ["--statistics", "--rule", "solid"], "literal-statistics": ["--statistics", "--rule", "literal"],
           "literal-holding": ["--holding", "--rule", "literal"]}
COLUMNS = {"effort": EFFORT_COLUMNS, "rows": ROWS_COLUMNS, "seeds": SEEDS_COLUMNS,
           "solid-statistics": EFFORT_COLUMNS, "literal-statistics": EFFORT_COLUMNS}


def certified_by(kind, certificate):
    counts = kind in ("plain", "solid") and certificate and os.path.exists(certificate)
    return ["--certificate", certificate] if counts else []


def table(database, kind, certificate):
    if kind in OWN_TABLES:
        title, rows_of = OWN_TABLES[kind]
        return markdown_of(rows_of(database), title)
    columns = ["--columns", ",".join(COLUMNS[kind])] if kind in COLUMNS else []
    return legopt("table", "--db", database, "--format", "markdown", *OPTIONS[kind], *columns,
                  *certified_by(kind, certificate))


def is_time(column):
    """Returns whether a column of `legopt table` depends on the machine and its load."""
    return (column.endswith("_ms") and not column.startswith("work")) or column in ("time_ratio", "reported", "contended")


def without_times(text):
    """Returns a CSV table without the columns of times."""
    rows = list(csv.reader(io.StringIO(text)))
    kept = [i for i, column in enumerate(rows[0]) if not is_time(column)]
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([row[i] for i in kept] for row in rows)
    return out.getvalue()


def write_csv(section, database, certificate, claims, folder, has_times):
    """Writes the tables of a section into a folder, and returns their file names. `claims`: of claim_rows."""
    names = []

    def create(kind):
        names.append(f"{section.name}-{kind}.csv")
        return open(os.path.join(folder, names[-1]), "w", encoding="utf-8", newline="")

    of_statistics = {"effort", "rows", "seeds", "statistics"}
    for kind in dict.fromkeys("statistics" if kind in of_statistics else kind for kind in section.tables):
        with create(kind) as file:
            if kind in OWN_TABLES:
                csv.writer(file, lineterminator="\n").writerows(OWN_TABLES[kind][1](database))
            else:
                text = legopt("table", "--db", database, "--format", "csv", *OPTIONS[kind], *certified_by(kind, certificate))
                file.write(text if has_times or kind == "targets" else without_times(text))
    if claims:
        with create("claims") as file:
            writer = csv.DictWriter(file, CLAIM_FIELDS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(claims)
    return names
