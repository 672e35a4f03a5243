#!/usr/bin/env python3
"""Makes scipy_cases.json, the reference table of the module legopt/statistics: 183 cases from a fixed seed, computed by
SciPy and, where SciPy 1.10 has no such function, by statsmodels or NumPy, never by code like that of the module. Tests
read only the table. To make it again with Debian 12's packages:

    apt-get install python3-scipy python3-statsmodels
    /usr/bin/python3 tests/statistics/make_scipy_cases.py > tests/statistics/scipy_cases.json

Compared functions, and differences in definitions:

* signed_rank_exact: scipy.stats.wilcoxon(mode="exact"), which is correct only without ties and zeros, and used only for
  such data.
* signed_rank_tied: the module's exact p with ties enumerates all 2^n signs of mid-ranks. SciPy 1.10's wilcoxon has no
  such mode, but permutation_test(permutation_type="samples") enumerates them. It regards sums within rounding as equal,
  like the module's integer doubled ranks.
* signed_rank_normal: wilcoxon(mode="approx", correction=False), zeros dropped ("wilcox") or ranked ("pratt"), with
  ties. The one-sided p are SciPy's as well.
* mcnemar: the exact p is binomtest's; SciPy has no mid-p, which is that minus binom.pmf (its definition).
* holm, cochran: statsmodels; SciPy has neither.
* friedman: friedmanchisquare divides by the correction for ties, like the module; F is computed from it with
  scipy.stats.f.
* newcombe: statsmodels 0.13 has no paired interval; published values only, in proportions_test.cpp.
* distribution, profile: percentileofscore(kind="weak"), the share of values <= x; infinite values represent failures.
* hodges_lehmann: numpy.median of the Walsh averages. None of these packages has the interval: published value and
  coverage are in paired_tests_test.cpp.
* bootstrap: scipy.stats.bootstrap with the module's random numbers instead of its own (below), so that intervals agree
  to rounding and not only in the mean. Constant data, for which SciPy returns NaN, are not included.

null is +infinity: a failure."""
import itertools
import json
import math
import warnings

import numpy as np
import scipy
import scipy.stats as stats
import statsmodels
from statsmodels.stats.contingency_tables import cochrans_q
from statsmodels.stats.multitest import multipletests

RANDOM = np.random.RandomState(20261122)
CASES = []


def plain(value):
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(item) for item in value]
    if isinstance(value, (np.integer, int)) and not isinstance(value, bool):
        return int(value)
    if isinstance(value, (np.floating, float)):
        assert not math.isnan(value)
        return None if math.isinf(value) else float(value)
    return value


def add(function, given, expected):
    CASES.append({"function": function, "given": plain(given), "expected": plain(expected)})


class Draws(np.random.RandomState):
    """Passes scipy.stats.bootstrap the indices drawn by the module: MT19937-64, upper 53 bits, floor of uniform times
    n."""

    def begin(self, seed):
        self.state = [seed]
        for i in range(1, 312):
            last = self.state[-1]
            self.state.append((6364136223846793005 * (last ^ (last >> 62)) + i) % 2**64)
        self.at = 312
        return self

    def word(self):
        state = self.state
        if self.at == 312:
            for i in range(312):
                x = (state[i] & 0xFFFFFFFF80000000) | (state[(i + 1) % 312] & 0x7FFFFFFF)
                state[i] = state[(i + 156) % 312] ^ (x >> 1) ^ (0xB5026F5AA96619E9 if x & 1 else 0)
            self.at = 0
        x = state[self.at]
        self.at += 1
        x ^= (x >> 29) & 0x5555555555555555
        x ^= (x << 17) & 0x71D67FFFEDA60000
        x ^= (x << 37) & 0xFFF7EEE000000000
        return x ^ (x >> 43)

    def randint(self, low, high=None, size=None, dtype=int):
        assert low == 0
        count = int(np.prod(size))
        drawn = np.array([int((self.word() >> 11) * 2.0**-53 * high) for _ in range(count)])
        return np.sort(drawn.reshape(size), axis=-1)  # sorted as in the module: equal samples then have equal bits,
                                                      # and tie


def times(count, failures=0.0):
    values = np.round(np.exp(RANDOM.normal(3.0, 1.2, count)), 3)
    values[RANDOM.uniform(size=count) < failures] = np.inf
    return values


def iman_davenport():
    for f, problems, methods in [(3.686313, 14, 4), (0.4, 2, 2), (25.0, 50, 3), (2.2, 50, 10), (7.5, 14, 2)]:
        chi_square = f * problems * (methods - 1) / (problems - 1 + f)
        add("iman_davenport", {"chi_square": chi_square, "problems": problems, "methods": methods},
            {"p": stats.f.sf(f, methods - 1, (methods - 1) * (problems - 1))})


def wilson():
    for successes, n in [(0, 1), (1, 1), (0, 20), (50, 50), (49, 50), (263, 500)]:
        interval = stats.binomtest(successes, n).proportion_ci(0.95, method="wilson")
        add("wilson", {"successes": successes, "problems": n, "level": 0.95}, {"interval": list(interval)})
    for _ in range(20):
        n = int(RANDOM.randint(2, 400))
        successes = int(RANDOM.randint(0, n + 1))
        level = float(RANDOM.choice([0.8, 0.9, 0.95, 0.99]))
        interval = stats.binomtest(successes, n).proportion_ci(level, method="wilson")
        add("wilson", {"successes": successes, "problems": n, "level": level}, {"interval": list(interval)})


def mcnemar():
    pairs = [(0, 1), (5, 5), (6, 0), (150, 86)]
    pairs += [(int(RANDOM.randint(0, 40)), int(RANDOM.randint(1, 40))) for _ in range(18)]
    pairs += [(0, 3), (4, 5), (6, 16), (30, 20), (470, 530), (2400, 2600)]
    for b, c in pairs:
        exact = stats.binomtest(b, b + c, 0.5).pvalue
        point = stats.binom.pmf(min(b, c), b + c, 0.5)
        add("mcnemar", {"only_first": b, "only_second": c},
            {"exact": exact, "mid": 1.0 - 0.5 * point if b == c else exact - point})


def wilcoxon(differences, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "sample size too small for normal approximation"
        p = {side: stats.wilcoxon(differences, alternative=side, **options).pvalue
             for side in ("greater", "less", "two-sided")}
    return {"greater": p["greater"], "less": p["less"], "two_sided": p["two-sided"]}


def signed_rank():
    for count in [1, 2, 5, 6, 9, 14, 20, 25, 30, 50]:
        differences = np.round(RANDOM.normal(0.3, 1.0, count), 6)
        assert len(set(abs(differences))) == count and 0.0 not in differences
        add("signed_rank_exact", {"differences": differences}, wilcoxon(differences, mode="exact"))
    for count in [3, 4, 6, 7, 8, 9, 10, 10, 11, 12]:
        differences = RANDOM.choice([-3, -2, -1, 1, 2, 3, 4], count).astype(float)
        ranks = stats.rankdata(abs(differences))
        sides = {}
        for side in ("greater", "less"):
            # The permutations of paired samples (r, 0) and (0, r) are all signs; the sum over one is V.
            first, second = np.where(differences > 0, ranks, 0.0), np.where(differences > 0, 0.0, ranks)
            sides[side] = stats.permutation_test((first, second), lambda x, y, axis: np.sum(x, axis=axis),
                                                 permutation_type="samples", n_resamples=np.inf, alternative=side,
                                                 vectorized=True).pvalue
        sides["two_sided"] = min(1.0, 2.0 * min(sides["greater"], sides["less"]))
        add("signed_rank_tied", {"differences": differences}, sides)
    for count, zeros in itertools.product([12, 25, 60, 230, 400], ["wilcox", "pratt"]):
        differences = RANDOM.randint(-8, 11, count).astype(float)
        add("signed_rank_normal", {"differences": differences, "zeros": zeros},
            wilcoxon(differences, mode="approx", correction=False, zero_method=zeros))


def families():
    for count in [1, 2, 3, 4, 6, 10, 15, 28, 45, 45]:
        p = np.round(RANDOM.beta(0.5, 4.0, count), 5)
        add("holm", {"p": p}, {"adjusted": multipletests(p, method="holm")[1]})
    for problems, methods in [(10, 2), (10, 3), (50, 3), (50, 4), (50, 8), (7, 5), (35, 6), (200, 3), (20, 10), (5, 4)]:
        chance = RANDOM.uniform(0.4, 0.95, methods)
        rows = (RANDOM.uniform(size=(problems, methods)) < chance).astype(int)
        answer = cochrans_q(rows)
        add("cochran", {"rows": rows}, {"q": answer.statistic, "p": answer.pvalue})
    for problems, methods in [(4, 3), (6, 3), (10, 3), (14, 4), (20, 5), (35, 4), (50, 8), (50, 3), (12, 10), (100, 6)]:
        rows = np.round(RANDOM.normal(0.0, 1.0, (problems, methods)) + 0.15 * np.arange(methods), 1)  # ties
        rows[RANDOM.uniform(size=rows.shape) < 0.1] = np.inf
        chi_square, p = stats.friedmanchisquare(*rows.T)
        f = (problems - 1) * chi_square / (problems * (methods - 1) - chi_square)
        add("friedman", {"rows": rows},
            {"chi_square": chi_square, "p": p, "mean_ranks": stats.rankdata(rows, axis=1).mean(axis=0), "f": f,
             "f_p": stats.f.sf(f, methods - 1, (methods - 1) * (problems - 1))})


def weak_share(values, x):
    return stats.percentileofscore(values, x, kind="weak") / 100.0


def profiles():
    for count in [1, 3, 10, 50, 80, 200]:
        values = times(count, 0.2)
        places = [1.0, 5.0, 20.0, 20.5, 60.0, 1e6] + list(values[np.isfinite(values)][:4])
        add("distribution", {"values": values, "at": places}, {"share": [weak_share(values, x) for x in places]})
    for problems, methods in [(1, 2), (5, 3), (20, 2), (35, 4), (50, 3), (50, 6)]:
        rows = np.array([times(methods, 0.25) for _ in range(problems)])
        best = rows.min(axis=1, keepdims=True)
        ratios = np.where(np.isfinite(rows), rows / np.where(np.isfinite(best), best, 1.0), np.inf)
        places = [1.0, 1.1, 1.5, 2.0, 4.0, 10.0, 100.0]
        add("profile", {"rows": rows, "at": places},
            {"share": [[weak_share(ratios[:, j], x) for x in places] for j in range(methods)]})


def summaries():
    for count, factor, limit in [(1, 10.0, 500.0), (5, 2.0, 300.0), (40, 10.0, 1000.0), (50, 1.0, 90.0),
                                 (9, 3.5, 60.0)]:
        values = times(count, 0.3)
        add("penalised_average", {"times": values, "limit": limit, "factor": factor},
            {"mean": np.mean(np.where(np.isinf(values), factor * limit, values))})
    for count in [1, 5, 20, 50, 200]:
        shares = RANDOM.randint(1, 5, count) / 4.0
        spent = times(count)
        add("expected_running_time", {"spent": spent, "shares": shares},
            {"time": np.average(spent / shares, weights=shares)})
    for count, shift in [(1, 1.0), (5, 1.0), (5, 10.0), (50, 1.0), (50, 10.0), (50, 0.0), (200, 5.0)]:
        values = times(count) / 10.0
        add("shifted_geometric_mean", {"times": values, "shift": shift},
            {"mean": stats.gmean(np.maximum(1.0, values + shift)) - shift})
    for count in [1, 6, 50, 300]:
        ratios = times(count) / 20.0
        add("geometric_mean", {"ratios": ratios}, {"mean": stats.gmean(ratios)})
    for count in [1, 2, 3, 10, 35, 50, 101, 200]:
        values = times(count)
        shares = [0.0, 0.05, 0.25, 0.5, 0.77, 0.95, 1.0]
        # Type 7 of Hyndman and Fan; mquantiles' own default is another type.
        add("quantiles", {"values": values, "shares": shares},
            {"quantiles": stats.mstats.mquantiles(values, shares, alphap=1, betap=1)})
    for count in [1, 2, 3, 8, 9, 25, 40]:
        values = np.round(RANDOM.normal(0.1, 1.0, count), 2)
        first, second = np.triu_indices(count)
        add("hodges_lehmann", {"differences": values}, {"estimate": np.median(0.5 * (values[first] + values[second]))})


STATISTICS = {
    "mean of first": lambda x, y: np.mean(x),
    "ratio of means": lambda x, y: np.mean(x) / np.mean(y),
    "ratio of geometric means": lambda x, y: stats.gmean(x) / stats.gmean(y),
    "variance of first": lambda x, y: np.var(x),
}


def bootstraps():
    for statistic, (kind, count) in itertools.product(
            STATISTICS, [("BCa", 8), ("BCa", 20), ("BCa", 50), ("percentile", 12)]):
        x, y = times(count), times(count)
        seed = int(RANDOM.randint(1, 2**31 - 1))
        level = float(RANDOM.choice([0.9, 0.95]))
        answer = stats.bootstrap((x, y), STATISTICS[statistic], paired=True, vectorized=False, n_resamples=400,
                                 confidence_level=level, method=kind, random_state=Draws().begin(seed))
        add("bootstrap", {"first": x, "second": y, "statistic": statistic, "kind": kind, "seed": seed, "level": level,
                          "resamples": 400},
            {"interval": list(answer.confidence_interval), "standard_error": answer.standard_error})


def main():
    assert Draws().begin(5489).word() == 14514284786278117030  # the generator's first word with its default seed
    for make in (iman_davenport, wilson, mcnemar, signed_rank, families, profiles, summaries, bootstraps):
        make()
    versions = f"SciPy {scipy.__version__}, statsmodels {statsmodels.__version__}, NumPy {np.__version__}"
    lines = ",\n".join(json.dumps(case) for case in CASES)
    assert len(CASES) == 183, len(CASES)
    print(f'{{"made_by": "make_scipy_cases.py with {versions}", "cases": [\n{lines}\n]}}')


if __name__ == "__main__":
    main()
