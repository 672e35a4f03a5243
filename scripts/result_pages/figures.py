"""Figures of the pages of results, as SVG files whose bytes depend on the databases only."""
import collections
import json
import os
import sys

from result_pages.program import legopt, query
from result_pages.tables import method_label, row_label, rule_of

FEWEST_ROWS = 3  # a section with fewer has no figures
# Multiples of the best known cost in the figure of targets: between 1 % above it and ten times as much.
TARGETS = [1.01, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0]
COLUMN_INCHES = 5.0
ROW_INCHES = 0.2
TOP_INCHES = 1.1


def pyplot():
    try:
        import matplotlib
    except ImportError as missing:
        sys.exit(f"make-results: figures need matplotlib ({missing}); on Debian: apt install python3-matplotlib")
    matplotlib.use("svg")
    # Text stays text, and identifiers are hashes of a fixed salt: equal data, equal bytes.
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "legopt", "font.size": 8, "axes.titlesize": 8})
    from matplotlib import pyplot as plot
    return plot


def save(figure, path):
    figure.savefig(path, metadata={"Date": None, "Creator": None}, bbox_inches="tight")
    pyplot().close(figure)


def style(index):
    """Returns colour, marker and line of a row, different for the first 60."""
    return {"color": f"C{index % 10}", "marker": "osD^vP"[index // 10 % 6], "linestyle": ("-", "--", ":")[index // 10 % 3]}


def legend_beside(axis):
    if axis.get_legend_handles_labels()[0]:
        axis.legend(fontsize=6, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def panel_title(panel):
    task, start = panel
    return f"{task}, {start.replace('_', ' ')}"


def panels_of(rows):
    return list(dict.fromkeys((row["task"], row["initialization"]) for row in rows))


def axes_of(panels, height, share_y=True):
    """Returns a figure with one row of axes, one for each panel."""
    figure, axes = pyplot().subplots(1, len(panels), figsize=(COLUMN_INCHES * len(panels), height), sharey=share_y,
                                     squeeze=False)
    for axis, panel in zip(axes[0], panels):
        axis.set_title(panel_title(panel))
        axis.grid(alpha=0.3)
    return figure, axes[0]


def list_downwards(axis, labels):
    axis.set_yticks(range(len(labels)), labels)
    axis.set_ylim(len(labels) - 0.5, -0.5)


def draw_success(rows, path):
    """Draws shares of solved problems with Wilson's intervals."""
    panels, labels = panels_of(rows), list(dict.fromkeys(map(row_label, rows)))
    figure, axes = axes_of(panels, TOP_INCHES + ROW_INCHES * len(labels))
    for axis, panel in zip(axes, panels):
        for row in rows:
            if (row["task"], row["initialization"]) != panel or not row["n"]:
                continue
            y, share = labels.index(row_label(row)), 100 * row["solved"] / row["n"]
            # Rounding may put an end of the interval beyond the share.
            ends = [max(share - 100 * row["share_lower"], 0)], [max(100 * row["share_upper"] - share, 0)]
            axis.errorbar(share, y, xerr=ends, fmt="o", color="C0", markersize=3, capsize=2)
        axis.set_xlim(-2, 102)
        axis.set_xlabel("solved, % of problems, with 95 % intervals")
        list_downwards(axis, labels)
    save(figure, path)


def draw_effort(rows, path):
    """Draws cost against work, both as ratios to the reference row on problems that both solved. False without any."""
    if not any(row["work_ratio"] is not None and row["cost_ratio"] is not None for row in rows):
        return False
    panels, labels = panels_of(rows), list(dict.fromkeys(map(row_label, rows)))
    figure, axes = axes_of(panels, 4.0, share_y=False)
    for axis, panel in zip(axes, panels):
        for row in rows:
            if (row["task"], row["initialization"]) != panel:
                continue
            has_ratios = row["work_ratio"] is not None and row["cost_ratio"] is not None
            label = row_label(row)
            axis.plot(*([row[name]] if has_ratios else [] for name in ("work_ratio", "cost_ratio")), label=label,
                      **style(labels.index(label)) | {"linestyle": "none", "markersize": 4})
        axis.set_xscale("log")
        axis.set_xlabel("work, ratio to the reference row")
        axis.set_ylabel("cost, ratio to the reference row")
    legend_beside(axes[-1])
    save(figure, path)
    return True


def draw_failures(database, path):
    """Draws the first check that failed, as shares of all runs of a row."""
    rule = rule_of(database)
    rows = query(database, f"SELECT {method_label(True)} AS label, task, initialization, "
                           f"coalesce(verdict_{rule}, state) AS reason, count(*) FROM job_list "
                           "GROUP BY label, task, initialization, reason ORDER BY min(job_id)")
    panels = list(dict.fromkeys((row[1], row[2]) for row in rows))
    labels = list(dict.fromkeys(row[0] for row in rows))
    totals, reasons = collections.Counter(), collections.Counter()
    for label, task, start, reason, number in rows:
        totals[label, task, start] += number
        reasons[reason] += number if reason != "success" else 0
    causes = [reason for reason, number in reasons.most_common() if number]
    if not causes:
        return False
    counts = {tuple(row[:4]): row[4] for row in rows}
    figure, axes = axes_of(panels, TOP_INCHES + ROW_INCHES * len(labels))
    for axis, panel in zip(axes, panels):
        begin = [0.0] * len(labels)
        for i, cause in enumerate(causes):
            shares = [100 * counts.get((label, *panel, cause), 0) / max(totals[label, *panel], 1) for label in labels]
            axis.barh(range(len(labels)), shares, left=begin, color=f"C{i % 10}", hatch="//" if i >= 10 else None,
                      label=cause.replace("_", " "))
            begin = [a + b for a, b in zip(begin, shares)]
        axis.set_xlim(0, 100)
        axis.set_xlabel("first check that failed, % of runs")
        list_downwards(axis, labels)
    legend_beside(axes[-1])
    save(figure, path)
    return True


def draw_targets(database, path):
    """Draws which share of all pairs of a problem and a target a row has reached after some work. Targets: TARGETS times
    the best known cost. A run reaches a target if its solution does, after all its work."""
    success = f"verdict_{rule_of(database)} = 'success'"
    rows = query(database, f"SELECT {method_label(True)} AS label, task, initialization, problem_id, cost, work_ns, "
                           f"{success} FROM job_list ORDER BY job_id")
    best = {}
    for _, task, _, problem, cost, _, solved in rows:
        if solved and cost is not None:
            best[task, problem] = min(cost, best.get((task, problem), cost))
    panels = list(dict.fromkeys((row[1], row[2]) for row in rows))
    reached, pairs = collections.defaultdict(list), collections.Counter()
    for label, task, start, problem, cost, work_ns, solved in rows:
        if (task, problem) not in best:
            continue
        pairs[label, task, start] += len(TARGETS)
        if solved and cost is not None and work_ns:
            num = sum(cost <= target * best[task, problem] for target in TARGETS)
            reached[label, task, start] += [1e-6 * work_ns] * num
    if not reached:
        return False
    labels = list(dict.fromkeys(row[0] for row in rows))
    longest = max(max(work, default=0.0) for work in reached.values())
    figure, axes = axes_of(panels, 4.0)
    for axis, panel in zip(axes, panels):
        for i, label in enumerate(labels):
            work = sorted(reached[label, *panel])
            shares = [100 * (k + 1) / pairs[label, *panel] for k in range(len(work))]
            axis.step([*work, longest], [*shares, shares[-1] if shares else 0], where="post", label=label,
                      **style(i) | {"marker": None})
        axis.set_xscale("log")
        axis.set_ylim(0, 100)
        axis.set_xlabel("work, ms")
        axis.set_ylabel("problems and targets reached, %")
    legend_beside(axes[-1])
    save(figure, path)
    return True


def draw_paper(database, path):
    """Draws our shares of success against the paper's. False if no row is of the paper's table."""
    rows = json.loads(legopt("table", "--db", database, "--format", "json", "--paper"))["rows"]
    points = collections.defaultdict(list)
    for row in rows:
        for task, starts in row.get("paper", {}).items():
            for start, theirs in starts.items():
                ours = row.get(task, {}).get(start)
                if ours and ours["n"]:
                    points[task, start].append((row_label(row), 100 * theirs["solved"] / theirs["n"],
                                                100 * ours["solved"] / ours["n"]))
    if not points:
        return False
    figure, axes = axes_of(list(points), 4.0)
    for axis, of_panel in zip(axes, points.values()):
        axis.plot([0, 100], [0, 100], color="0.7", linewidth=0.8)
        for i, (label, theirs, ours) in enumerate(of_panel):
            axis.plot(theirs, ours, label=label, **style(i) | {"linestyle": "none", "markersize": 4})
        axis.set_xlabel("solved in the paper, %")
        axis.set_ylabel("solved here, %")
    legend_beside(axes[-1])
    save(figure, path)
    return True


def draw(section, database, folder):
    """Draws the figures of a section into a folder. Returns pairs of a caption and a file name."""
    statistics = json.loads(legopt("table", "--db", database, "--format", "json", "--statistics"))
    rows = statistics["rows"]
    if len(set(map(row_label, rows))) < FEWEST_ROWS:
        return []
    drawn = []

    def add(kind, caption, action):
        name = f"{section.name}-{kind}.svg"
        if action(os.path.join(folder, name)) is not False:
            drawn.append((caption, name))

    references = sorted({column["reference"] for column in statistics["columns"] if column["reference"]})
    multiples = f"{TARGETS[0]} to {TARGETS[-1]:g} times the best known cost"
    add("success", "Success, with 95 % intervals", lambda path: draw_success(rows, path))
    if references:
        add("effort", f"Cost against work (reference row: {', '.join(references)})", lambda path: draw_effort(rows, path))
    add("failures", "Causes of failure", lambda path: draw_failures(database, path))
    if any(row["solved"] for row in rows):
        add("profile", "Performance profile of work",
            lambda path: legopt("plot", "profile", "--no-caption", "--db", database, "--out", path))
    add("targets", f"Pairs of a problem and a target reached; targets are {multiples}",
        lambda path: draw_targets(database, path))
    if section.suite == "table1":
        add("paper", "Success here against the paper's", lambda path: draw_paper(database, path))
    return drawn
