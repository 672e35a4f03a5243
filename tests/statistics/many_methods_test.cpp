// Policy: published examples, agreement between tests of which one is a special case of the other, invariance under
// irrelevant changes, and a defined result if methods do not differ.

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "legopt/math/random_numbers.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/internal/checks.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

using ::testing::DoubleEq;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Holm, OfWorkedExamples) {
  EXPECT_THAT(HolmAdjusted(std::vector<double>{0.01, 0.04, 0.03, 0.005}),
              ElementsAre(DoubleEq(0.03), DoubleEq(0.06), DoubleEq(0.06), DoubleEq(0.02)));
  EXPECT_THAT(HolmAdjusted(std::vector<double>{0.0001, 0.01, 0.02, 0.03, 0.04}),
              ElementsAre(DoubleEq(0.0005), DoubleEq(0.04), DoubleEq(0.06), DoubleEq(0.06), DoubleEq(0.06)));
}

TEST(Holm, IsMonotoneAndBetweenPlainAndBonferroni) {
  std::mt19937_64 generator(2);
  for (int sample = 0; sample < 200; ++sample) {
    std::vector<double> p(static_cast<std::size_t>(1 + sample % 30));
    for (double& value : p) value = std::pow(UniformRandom(generator), 3.0);
    const std::vector<double> adjusted = HolmAdjusted(p);
    for (std::size_t i = 0; i < p.size(); ++i) {
      EXPECT_GE(adjusted[i], p[i]);
      EXPECT_LE(adjusted[i], std::min(1.0, p[i] * static_cast<double>(p.size()) * (1.0 + 1e-15)));
      for (std::size_t j = 0; j < p.size(); ++j) {
        if (p[i] <= p[j]) {
          EXPECT_LE(adjusted[i], adjusted[j]);
        }
      }
    }
    std::vector<double> reversed(p.rbegin(), p.rend());
    reversed = HolmAdjusted(reversed);
    EXPECT_TRUE(std::equal(adjusted.begin(), adjusted.end(), reversed.rbegin()));
  }
}

TEST(Holm, OfNoneOneAndBadP) {
  EXPECT_THAT(HolmAdjusted({}), IsEmpty());
  EXPECT_THAT(HolmAdjusted(std::vector<double>{0.3}), ElementsAre(0.3));
  EXPECT_THAT(HolmAdjusted(std::vector<double>{1.0, 1.0}), ElementsAre(1.0, 1.0));
  EXPECT_REFUSED(HolmAdjusted(std::vector<double>{1.2}), "HolmAdjusted: p: must lie in [0, 1] (got '1.2')");
  EXPECT_REFUSED(HolmAdjusted(std::vector<double>{std::nan("")}), "got 'nan'");
}

// Ten problems, three methods; statsmodels gives the same.
TEST(CochranQ, OfAWorkedExample) {
  const std::vector<std::vector<int>> rows{{1, 1, 0}, {1, 1, 0}, {0, 1, 0}, {1, 1, 1}, {0, 1, 0},
                                           {1, 1, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 0}, {1, 1, 0}};
  const CochranTest test = CochranQ(rows);
  EXPECT_EQ(test.q, 9.75);
  EXPECT_EQ(test.degrees, 2);
  EXPECT_EQ(test.informative, 8);
  EXPECT_NEAR(test.p, 0.007635, 5e-7);
}

TEST(CochranQ, OfTwoMethodsIsMcNemarsChiSquare) {
  std::vector<std::vector<int>> rows(150, {1, 0});
  rows.resize(150 + 86, {0, 1});
  rows.resize(1600, {1, 1});
  EXPECT_NEAR(CochranQ(rows).q, 17.3559, 5e-5);  // Agresti's approval ratings
  EXPECT_NEAR(CochranQ(rows).p, 3.099e-5, 5e-9);
}

TEST(CochranQ, ProblemsThatAllSolveOrNoneChangeNothing) {
  std::vector<std::vector<int>> rows{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 1}};
  const double q = CochranQ(rows).q;
  rows.push_back({1, 1, 1});
  rows.insert(rows.begin(), {0, 0, 0});
  EXPECT_NEAR(CochranQ(rows).q, q, 1e-12);
  EXPECT_EQ(CochranQ(rows).informative, 4);
}

TEST(CochranQ, WithoutADifferenceThereIsNoTest) {
  EXPECT_EQ(CochranQ({}).p, 1.0);
  const std::vector<std::vector<int>> agreeing{{1, 1, 1}, {0, 0, 0}};
  EXPECT_EQ(CochranQ(agreeing).informative, 0);
  EXPECT_EQ(CochranQ(agreeing).p, 1.0);
  const std::vector<std::vector<int>> one_method{{1}, {0}};
  EXPECT_EQ(CochranQ(one_method).informative, 0);
  EXPECT_EQ(CochranQ(one_method).p, 1.0);
  const std::vector<std::vector<int>> balanced{{1, 0}, {0, 1}};
  EXPECT_EQ(CochranQ(balanced).q, 0.0);
  EXPECT_EQ(CochranQ(balanced).p, 1.0);
}

TEST(CochranQ, RefusesBadInput) {
  const std::vector<std::vector<int>> counts{{1, 0}, {2, 0}};
  EXPECT_REFUSED(CochranQ(counts), "CochranQ: rows[1]: must hold zeros and ones (got '2')");
  const std::vector<std::vector<int>> ragged{{1, 0}, {1}};
  EXPECT_REFUSED(CochranQ(ragged), "CochranQ: rows[1]: must be as long as its counterpart, 2 (got '1')");
}

// Ranks of four variants of C4.5 on 14 data sets (Demsar 2006, table 6), as printed. Ranks are used as input because
// his voting row ranks equal figures differently.
const std::vector<std::vector<double>> kDemsar{{4, 3, 2, 1}, {1, 2, 3, 4},         {4, 1, 2, 3},     {4, 1, 3, 2},
                                               {4, 2, 3, 1}, {1, 2.5, 4, 2.5},     {3, 2, 4, 1},     {2.5, 2.5, 4, 1},
                                               {4, 3, 2, 1}, {2.5, 2.5, 2.5, 2.5}, {4, 2.5, 1, 2.5}, {3, 2, 4, 1},
                                               {4, 1, 2, 3}, {3, 1, 4, 2}};

TEST(Friedman, OfDemsarsTable) {
  const FriedmanTest test = Friedman(kDemsar);
  EXPECT_THAT(test.mean_ranks,
              ElementsAre(DoubleNear(3.143, 5e-4), 2.0, DoubleNear(2.893, 5e-4), DoubleNear(1.964, 5e-4)));
  EXPECT_NEAR(test.chi_square * test.tie_correction, 9.278571, 5e-7);  // his formula, without ties
  EXPECT_NEAR(test.chi_square, 10.228, 5e-4);                          // with ties
  const ImanDavenportTest his = ImanDavenport(9.278571, 14, 4);
  EXPECT_NEAR(his.f, 3.686313, 5e-6);
  EXPECT_EQ(his.numerator, 3);
  EXPECT_EQ(his.denominator, 39);
  EXPECT_NEAR(his.p, 0.0198, 5e-5);
}

TEST(ImanDavenport, HasTheClosedFormsOfF) {
  const auto p_of = [](double f, int problems, int methods) {
    return ImanDavenport(f * problems * (methods - 1) / (problems - 1 + f), problems, methods).p;
  };
  for (const double f : {0.01, 0.5, 1.0, 3.0, 50.0}) {
    EXPECT_NEAR(p_of(f, 6, 3) / std::pow(1.0 + 2.0 * f / 10.0, -5.0), 1.0, 1e-12) << f;             // F(2, 10)
    EXPECT_NEAR(p_of(f, 2, 2), 1.0 - 2.0 / std::acos(-1.0) * std::atan(std::sqrt(f)), 1e-13) << f;  // F(1, 1)
  }
  EXPECT_NEAR(p_of(2.845, 14, 4), 0.05, 1e-4);  // critical F(3, 39) = 2.85 of Demsar 2006
  EXPECT_EQ(p_of(0.0, 14, 4), 1.0);
  EXPECT_EQ(ImanDavenport(42.0, 14, 4).p, 0.0);  // all problems rank the methods alike
}

TEST(Friedman, ForgetsTheOrderAndEveryMonotoneScale) {
  const FriedmanTest test = Friedman(kDemsar);
  std::vector<std::vector<double>> turned(kDemsar.rbegin(), kDemsar.rend());
  for (std::size_t i = 0; i < turned.size(); ++i) {
    std::reverse(turned[i].begin(), turned[i].end());
    for (double& value : turned[i]) value = std::exp(value + static_cast<double>(i));  // scaled per problem
  }
  const FriedmanTest other = Friedman(turned);
  EXPECT_EQ(other.chi_square, test.chi_square);
  EXPECT_EQ(other.mean_ranks[0], test.mean_ranks[3]);
}

TEST(Friedman, FailuresTieAtTheLastRank) {
  const std::vector<std::vector<double>> rows{{1.0, kInfinity, kInfinity}, {2.0, 5.0, kInfinity}};
  EXPECT_THAT(Friedman(rows).mean_ranks, ElementsAre(1.0, 2.25, 2.75));
}

TEST(Friedman, OfSolvedAndFailedIsCochransQ) {
  std::mt19937_64 generator(4);
  std::vector<std::vector<double>> values;
  std::vector<std::vector<int>> solved;
  for (int problem = 0; problem < 30; ++problem) {
    std::vector<int> row;
    for (const double chance : {0.9, 0.6, 0.5, 0.7}) row.push_back(UniformRandom(generator) < chance ? 1 : 0);
    solved.push_back(row);
    std::vector<double>& of_problem = values.emplace_back();
    for (const int ends : row) of_problem.push_back(ends == 1 ? 1.0 : kInfinity);
  }
  EXPECT_NEAR(Friedman(values).chi_square, CochranQ(solved).q, 1e-12);
}

TEST(Friedman, FullAgreement) {
  const FriedmanTest test = Friedman(std::vector<std::vector<double>>(5, {1.0, 2.0, 3.0}));
  EXPECT_EQ(test.chi_square, 10.0);
  EXPECT_EQ(test.iman_davenport.f, kInfinity);
  EXPECT_EQ(test.iman_davenport.p, 0.0);
}

TEST(Friedman, WithoutADifferenceThereIsNoTest) {
  EXPECT_FALSE(Friedman({}).defined);
  EXPECT_EQ(Friedman({}).p, 1.0);
  EXPECT_THAT(Friedman({}).mean_ranks, IsEmpty());
  const FriedmanTest tied = Friedman(std::vector<std::vector<double>>(4, {kInfinity, kInfinity, kInfinity}));
  EXPECT_FALSE(tied.defined);
  EXPECT_THAT(tied.mean_ranks, ElementsAre(2.0, 2.0, 2.0));
  EXPECT_EQ(tied.tie_correction, 0.0);
  EXPECT_EQ(tied.p, 1.0);
  const FriedmanTest one_method = Friedman(std::vector<std::vector<double>>(4, {1.0}));
  EXPECT_FALSE(one_method.defined);
  EXPECT_THAT(one_method.mean_ranks, ElementsAre(1.0));
  EXPECT_EQ(one_method.p, 1.0);
  const FriedmanTest one_problem = Friedman(std::vector<std::vector<double>>{{1.0, 2.0}});
  EXPECT_TRUE(one_problem.defined);
  EXPECT_EQ(one_problem.chi_square, 1.0);
  EXPECT_EQ(one_problem.iman_davenport.denominator, 0);
  EXPECT_EQ(one_problem.iman_davenport.p, 1.0);
}

TEST(Friedman, RefusesBadInput) {
  EXPECT_REFUSED(Friedman(std::vector<std::vector<double>>{{1.0, 2.0}, {1.0}}), "Friedman: rows[1]: must be as long");
  EXPECT_REFUSED(Friedman(std::vector<std::vector<double>>{{1.0, std::nan("")}}),
                 "Friedman: rows[0][1]: must be a number");
  EXPECT_REFUSED(ImanDavenport(9.0, 2, 3), "ImanDavenport: chi_square");
  EXPECT_REFUSED(ImanDavenport(-1.0, 2, 3), "ImanDavenport: chi_square");
  EXPECT_REFUSED(ImanDavenport(0.0, -2, 3), "ImanDavenport: problems");
}

}  // namespace
}  // namespace legopt::statistics
