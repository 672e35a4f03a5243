"""Texts before the tables of the pages that scripts/make-results writes."""

BEST_HEAD = """# LegOpt-best, problem by problem

`scripts/make-results --best` writes this whole page; no figure is written by hand. It has the row LegOpt-best only: on
LegOpt's problems, on the embedded datasets, and in eight generated buildings whose seeds follow from the hash of the
commit ([ledger](seeds.md)). Obstacles are solids, two-sided triangles, or triangles with a front
([obstacle models](../docs/explanation/paper.md#two-sided-triangles)). Success is by the
[solid rule](../docs/explanation/judge.md#solid-rule) unless a table names another one. Tables count over
[certified](../docs/reference/datasets.md#certificates) problems; parentheses hold the counts of the others.
[Table I](table1.md) compares LegOpt-best with other methods.
"""

HARD_HEAD = """# Table I on the hard garage

`scripts/make-results --hard` writes this whole page; no figure is written by hand. It has every row of the paper's Table
I on the embedded garage at level hard. All problems of that garage are
[certified](../docs/reference/datasets.md#certificates). Success is by the original evaluator's rule (`literal`). Times
are per waypoint in the plain tables, and of whole solves in the statistics
([definitions](../docs/explanation/statistics.md)). [Table I](table1.md) explains tables of claims. LegOpt-best there:
[LegOpt-best](legopt-best.md#legopt-best-on-the-hard-garage).
"""

SEEDS_HEAD = """# Ten seeds

`scripts/make-results --seeds` writes this whole page; no figure is written by hand. Random numbers change the noise of
restarts and the samples of stochastic methods. Here each method solves each problem with ten seeds, from initial guesses
in collision. Motions have at most 80 stances. All methods end at the tolerance 1e-4. Success is by the
[solid rule](../docs/explanation/judge.md#solid-rule). The page has no times: success, cost and work are the same on
every machine with this build.

*Seeds* is the number of problems that the worst and the best seed solved; the interval is Wilson's, with the problem as
unit ([definitions](../docs/explanation/statistics.md#legopt-table---statistics)). In the comparisons, *figure* is B - A
for shares of success, and B / A for work and costs. Success is compared by a permutation test. *Reads* is the verdict of
`legopt compare` about B, the second row named; "none" means that no difference was shown.
"""

PARTS_HEAD = """# LegOpt-best without single parts

`scripts/make-results --parts` writes this whole page; no figure is written by hand. It has no times: success, cost and
work are the same on every machine with this build.

[LegOpt-best](../docs/explanation/legopt-best.md) is the paper's penalty SQP with further parts, which that page states in
formulas. `without waypoints alone` also lacks chains, which begin with such waypoints. `without internal restarts` lacks
everything after the first descent; `restarts instead` has ten ordinary restarts in its place. `SQP with internal
restarts` has waypoints solved alone and noise only. `SQP` is the paper's, with 0, 10 and 40 restarts.

All rows end at the tolerance 1e-4. Success is by the [solid rule](../docs/explanation/judge.md#solid-rule). In the
comparisons A is LegOpt-best, and *figure* is B - A for shares of success, B / A for work and costs
([options](../docs/reference/suites.md#options-of-the-solver-best), [definitions](../docs/explanation/statistics.md)).
"""

EQUAL_EFFORT_HEAD = """# All solvers at equal effort

`scripts/make-results --equal-effort` writes this whole page; no figure is written by hand. It has no times: success, cost
and work are the same on every machine with this build.

Every solver restarts from perturbed initial guesses until a run solves its problem or has made 300,000 term evaluations
for a posture, 2,000,000 for a motion, or 1,000 restarts. CMA-ES doubles its samples with each restart
([IPOP](../docs/reference/suites.md#options-of-the-solver-cma_es)). LegOpt-best also restarts inside an attempt, and goes
back to earlier stances only after the last restart of a window. All end at the tolerance 1e-4. Success is by the
[solid rule](../docs/explanation/judge.md#solid-rule).

*Targets* are multiples of the best known cost of a problem
([definition](../docs/explanation/statistics.md#legopt-table---targets-101112)). In the comparisons A is LegOpt-best, and
*figure* is B - A for shares of success, B / A for work on problems that both solved.
"""

ORIGINAL_RULE_HEAD = """# What the original rule accepts

`scripts/make-results --original-rule` writes this whole page; no figure is written by hand. It has no times.

The original evaluator ignores pairs of links whose meshes intersect in a reference posture: on the Atlas both thighs, and
the pelvis with either thigh and with `utorso` ([ignored pairs](../docs/explanation/judge.md#ignored-link-pairs)). So its
rule accepts motions in which these bodies overlap. LegOpt-best solved the motions below twice, with all pairs of links and
with the pairs of that rule. Both rows are counted by the original rule, then by the
[solid rule](../docs/explanation/judge.md#solid-rule), which checks all pairs. A table names the pairs that overlap deepest.

The rule ignores no pair of the embedded humanoid, so there is nothing to compare there.

The last table asks whether joints and contacts can hold the robot at the waypoints of motions that the original rule
accepts ([definitions](../docs/explanation/judge.md#physical-rule)): `held` is the number of motions in which
no posture exceeds an effort limit or lacks static equilibrium.
"""

CONTACTS_HEAD = """# Postures and motions that need hands

`scripts/make-results --contacts` writes this whole page; no figure is written by hand. It has no times: success, cost and
work are the same on every machine with this build.

The datasets are the embedded ones of `generate dataset --kind contacts`
([families and levels](../docs/how-to/make-a-dataset.md#stations)). Each problem has a planted solution, except the traps:
a proof excludes every posture there. All methods have the same constraints: static equilibrium, friction, effort limits
and pushes ([physics](../docs/explanation/problem.md#physics)). The solvers' options differ. LegOpt-best was tuned for these
families: `initial_penalty` 1000 (SQP: 100), `contact_range_m` 0.06 (0.03), noise of 0.4. Each of its restarts contains
internal ones; their number is in the table. Success is by the
[physical rule](../docs/explanation/judge.md#physical-rule). Postures of all methods end at the tolerance 1e-4. Motions
have LegOpt-best only, at its own tolerance of 4e-4, and the humanoid's without restarts: with ten, a motion that fails
can take ten minutes, by SQP as well. Each job ran once; [ten seeds](ten-seeds.md) shows how much a seed changes. In the
comparisons *figure* is B - A for shares of success, and B / A for work; *reads* is the verdict of `legopt compare` about
B, the second row named, and "none" means that no difference was shown
([definitions](../docs/explanation/statistics.md)).
"""

DURATIONS_HEAD = """# Which motions a robot can execute

`scripts/make-results --durations` writes this whole page; no figure is written by hand. It has no times of computing:
durations, success, cost and work are the same on every machine with this build.

A motion can be executed if it has an admissible time law: joint velocities, torques and contact forces stay within their
limits along its curve. Its duration T* is the least one ([formulas](../docs/explanation/timing.md)). Timed motions must
also satisfy every constraint on that curve ([definition](../docs/explanation/judge.md#timed-motions)). Their cost is T*
divided by the number of stances, in seconds. Only LegOpt-best was tuned for them, and it has options of its own: collision
between waypoints is required (others: preferred), the tolerance is 4e-4 (others: 1e-4), and those of
[postures with hands](contacts.md). It has internal restarts; their number is in the table. `legopt run timed` has all rows
of the suite.

The last sections have motions of at most 120 stances that were made without time. They keep their points and are joined by
the same curve, whether or not it keeps the contacts in place: *executable* concerns velocities, torques and forces only.
*At 80 %*: with friction and effort limited to 80 %. *Greedy*: the duration of TOPP-RA's pass, divided by T*.
"""

HEAD = """# What the benchmark shows

`scripts/make-results` writes this whole page; no figure is written by hand. Each table names its rule of success. Times
are per waypoint in the plain tables, and of whole solves in the statistics
([definitions](../docs/explanation/statistics.md),
[what was tuned on what](../docs/explanation/fidelity.md#what-has-been-tuned-on-what)). The paper's times are of another
computer and another garage, and compare in trend only.

Plain tables count over [certified](../docs/reference/datasets.md#certificates) problems; parentheses hold the counts of
the others. In tables of claims, *figure* is B - A for shares of success, and B / A for times and costs. *Reads* is the
verdict of `legopt compare` about B, the second row named; "none" means that no difference was shown.
[Earlier figures](earlier.md) has results of earlier builds, with LegOpt's own problems and with triangles as obstacles.
"""
