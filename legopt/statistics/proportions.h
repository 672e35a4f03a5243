#pragma once

#include "legopt/statistics/interval.h"
#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {

/// Computes the score interval of Wilson (1927, JASA 22:209; Newcombe 1998, Stat. Med. 17:857) for a share of problems.
/// With p = successes / problems and z the quantile of the level, its middle is (p + z^2/2n) / (1 + z^2/n) and its half
/// width z / (1 + z^2/n) sqrt(p (1 - p)/n + z^2/4n^2). For 50 of 50, the lower end is 92.9 %.
///
/// `successes` may be fractional, the sum of the problems' shares of solved repetitions. Such shares vary less than
/// zeros and ones, so that the interval is then conservative. No problems: [0, 1]. Throws InputError for negative
/// numbers, more successes than problems, and a `level` outside (0, 1).
Interval WilsonInterval(double successes, int problems, double level = 0.95);

/// Difference of two shares with its confidence interval.
struct ShareDifference {
  double estimate = 0.0;  ///< share of the first minus share of the second, in [-1, 1]
  Interval interval;      ///< within [-1, 1]
};

/// Computes the difference in success of two methods on the same problems by method 10 of Newcombe (1998, Stat. Med.
/// 17:2635). It combines the Wilson intervals of both shares with the correlation phi of the successes, whose numerator
/// ad - bc is lowered by n/2 (not below 0) if positive; phi = 0 if a margin is empty. With l, u the ends of the
/// intervals and d1 = p1 - l1, d2 = u2 - p2 the lower end is p1 - p2 - sqrt(d1^2 - 2 phi d1 d2 + d2^2); the upper end
/// is symmetric. No pairs: 0 in [-1, 1]. Throws InputError for negative counts and a `level` outside (0, 1).
ShareDifference PairedShareDifference(const PairCounts& counts, double level = 0.95);

/// Result of McNemar's test: does one of two methods solve more problems?
struct McNemarTest {
  int discordant = 0;    ///< problems that exactly one method solved; 0: no test, print a dash; both p are 1
  double exact_p = 1.0;  ///< two-sided, min(1, 2 P(X <= min(b, c))), X ~ Bin(b + c, 1/2)
  double mid_p = 1.0;    ///< recommended: exact_p - P(X = min(b, c)), and 1 - P(X = b)/2 for b = c
};

/// Computes McNemar's test (1947, Psychometrika 12:153) for b problems solved by the first method only and c by the
/// second only; problems solved by both or neither are irrelevant. Fagerland, Lydersen and Laake (2013, BMC Med. Res.
/// Methodol. 13:91) recommend the mid-p and advise against the exact p, which is too conservative: with all discordant
/// problems on one side, it needs 6 of them for p < 0.05, the mid-p 5. Throws InputError for negative counts.
McNemarTest McNemar(int only_first, int only_second);

}  // namespace legopt::statistics
