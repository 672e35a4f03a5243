#!/usr/bin/env python3
"""Two figures of an experiment: performance profiles of all its methods, and the times of two of them problem by
problem.

    legopt run quick --db results.sqlite
    PYTHONPATH=python LEGOPT=build/legopt examples/python/two_figures.py results.sqlite LegOpt-best Adam --out figures

writes profiles.svg, profiles.png, pairs.svg and pairs.png. PYTHONPATH and LEGOPT are needed only in the source tree,
not after installation. The parts between the lines "# %%" are cells for editors that support them. """

# %% Arguments
import argparse
import csv
import io
import os
import sys

import legopt

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("database")
parser.add_argument("a", metavar="A", help="a method, as legopt compare names it: SQP, or SQP:multi_starts=10")
parser.add_argument("b", metavar="B", help="another one")
parser.add_argument("--experiment", help="number or name (default: the newest)")
parser.add_argument("--rule", default="literal", help="whose success counts: literal, strict or solid")
parser.add_argument("--out", default=".", help="folder of the figures, made where it is not there")
asked = parser.parse_args()

try:
    import matplotlib
    matplotlib.use("Agg")  # files only, no window
    from matplotlib import pyplot
except ImportError as missing:
    sys.exit(f"two_figures: drawing needs matplotlib ({missing}); on Debian: apt install python3-matplotlib")


def save(figure, name):
    """Saves a figure as SVG for pages and papers, and as PNG for other uses."""
    os.makedirs(asked.out, exist_ok=True)
    for suffix in ("svg", "png"):
        path = os.path.join(asked.out, f"{name}.{suffix}")
        figure.savefig(path, dpi=150)
        print(path)


# %% The data: the profiles are the program's, the pairs are rows of the database
try:
    db = legopt.open(asked.database)
    methods = {method["method_id"]: method["choice"] for method in db.methods(asked.experiment)}
    experiment = db.methods(asked.experiment)[0]["experiment_id"]
    profiles = list(csv.DictReader(io.StringIO(
        db.run("table", experiment, "--profile", "--rule", asked.rule, "--format", "csv"))))
    pairs = db.paired(asked.a, asked.b, experiment, rule=asked.rule)
except legopt.LegoptError as error:
    sys.exit(f"two_figures: {error}")

# %% Figure 1: share of the problems on which a method took at most this multiple of the best time
panels = {}
for step in profiles:
    panels.setdefault((step["task"], step["initialization"]), []).append(step)
# Colour, dash and marker identify a method, even if printed without colours.
styles = {number: {"color": f"C{i % 10}", "linestyle": ["-", "--", "-.", ":"][i % 4], "marker": "osD^vPX*"[i % 8]}
          for i, number in enumerate(methods)}
farthest = 1.1 * max((float(step["ratio"]) for step in profiles), default=1.0)
figure, all_axes = pyplot.subplots(1, max(len(panels), 1), figsize=(1 + 4 * max(len(panels), 1), 4), sharey=True,
                                   squeeze=False, layout="constrained")
for axes, ((task, start), steps) in zip(all_axes[0], panels.items()):
    for number, choice in methods.items():
        curve = [(float(step["ratio"]), float(step["share"])) for step in steps if int(step["method_id"]) == number]
        if curve:
            curve.append((farthest, curve[-1][1]))
        axes.step([ratio for ratio, _ in curve], [share for _, share in curve], where="post", label=choice,
                  markevery=slice(0, -1), markersize=4, **styles[number])
    axes.set(xscale="log", xlim=(1, farthest), ylim=(-0.02, 1.02), xlabel="time / best time",
             title=f"{task}, {start}, {steps[0]['problems']} problems")
all_axes[0][0].set_ylabel("share of problems")
all_axes[0][0].legend(loc="lower right", fontsize="small")
save(figure, "profiles")

# %% Figure 2: a point for each problem that either solved; below the diagonal B is faster, on a rim it was not solved
solved = [time for pair in pairs for time in (pair["solve_ms_a"], pair["solve_ms_b"]) if time is not None]
if not solved:
    sys.exit("two_figures: neither method solved a problem; there is nothing to draw")
low, rim = 0.7 * min(solved), 2 * max(solved)
figure, axes = pyplot.subplots(figsize=(5, 5), layout="constrained")
for i, panel in enumerate(sorted({(pair["task"], pair["initialization"]) for pair in pairs})):
    of_panel = [pair for pair in pairs if (pair["task"], pair["initialization"]) == panel
                and (pair["solve_ms_a"] is not None or pair["solve_ms_b"] is not None)]
    axes.scatter([pair["solve_ms_a"] or rim for pair in of_panel], [pair["solve_ms_b"] or rim for pair in of_panel],
                 marker="osD^"[i % 4], s=18, alpha=0.7, clip_on=False, zorder=3, label=", ".join(panel))
axes.plot([low, rim], [low, rim], color="0.6", linewidth=1)
axes.set(xscale="log", yscale="log", xlim=(low, rim), ylim=(low, rim), xlabel=f"time of {pairs[0]['choice_a']} (ms)",
         ylabel=f"time of {pairs[0]['choice_b']} (ms)")
axes.legend(fontsize="small")
save(figure, "pairs")
db.close()
