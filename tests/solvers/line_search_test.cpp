// The smooth penalties and the step lengths of gradient methods, on functions with known answers.

#include "legopt/solvers/internal/line_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "legopt/solvers/internal/smooth_objective.h"

namespace legopt {
namespace {

TEST(SmoothPenalty, SlopeIsTheDerivativeOfTheValue) {
  constexpr double kSharpness = 50.0, kStep = 1e-6, kTolerance = 1e-8;
  for (const TermKind kind : {TermKind::kCost, TermKind::kEquality, TermKind::kInequality}) {
    for (const double r : {-2.0, -0.1, -1e-3, 1e-3, 0.03, 0.1, 2.0}) {
      const double difference =
          SmoothShare(kind, r + kStep, kSharpness).value - SmoothShare(kind, r - kStep, kSharpness).value;
      EXPECT_NEAR(SmoothShare(kind, r, kSharpness).slope, difference / (2 * kStep), kTolerance) << r;
    }
  }
}

TEST(SmoothPenalty, IsThePapersSlopeAndTouchesTheExactPenaltyFromBelow) {
  constexpr double kSharpness = 1e2;
  for (const double h : {-0.2, -0.01, 0.0, 0.001, 0.05}) {
    const double e = std::exp(kSharpness * h);
    EXPECT_NEAR(SmoothAbs(h, kSharpness).slope, -1.0 + 2.0 * e / (1.0 + e), 1e-14);
    EXPECT_LE(SmoothAbs(h, kSharpness).value, std::abs(h));
    EXPECT_GE(SmoothAbs(h, kSharpness).value, std::abs(h) - 2.0 * std::numbers::ln2 / kSharpness - 1e-15);
  }
  EXPECT_EQ(SmoothAbs(0.0, kSharpness).value, 0.0);
}

TEST(SmoothPenalty, LargeArgumentsDoNotOverflow) {
  for (const double h : {1e3, 1e150, -1e150}) {
    const ValueAndSlope at = SmoothAbs(h, 1e4);
    EXPECT_DOUBLE_EQ(at.value, std::abs(h) - 2.0 * std::numbers::ln2 / 1e4);
    EXPECT_EQ(at.slope, h > 0 ? 1.0 : -1.0);
  }
}

TEST(SmoothPenalty, InequalitiesAreOneSidedAndNotANumberStays) {
  EXPECT_EQ(SmoothShare(TermKind::kInequality, -0.5, 10).value, 0.0);
  EXPECT_EQ(SmoothShare(TermKind::kInequality, 0.0, 10).slope, 0.0);
  EXPECT_EQ(SmoothShare(TermKind::kInequality, 0.5, 10).slope, SmoothAbs(0.5, 10).slope);
  for (const TermKind kind : {TermKind::kCost, TermKind::kEquality, TermKind::kInequality}) {
    EXPECT_TRUE(std::isnan(SmoothShare(kind, std::nan(""), 10).value));
  }
}

class Function : public LineFunction {
 public:
  using Real = std::function<double(double)>;
  Function(Real value, Real slope) : value_(std::move(value)), slope_(std::move(slope)) {}
  double Value(double alpha) override {
    ++trials;
    alpha_ = alpha;
    return value_(alpha);
  }
  double Slope() override { return slope_(alpha_); }

  LineStart Start(double first_alpha, double max_alpha = 1e6) {
    return {value_(0.0), slope_(0.0), first_alpha, max_alpha};
  }
  int trials = 0;

 private:
  Real value_, slope_;
  double alpha_ = 0.0;
};

void ExpectWolfe(Function& phi, const LineStart& start, const LineSearchResult& found) {
  const LineSearchOptions options;
  EXPECT_TRUE(found.wolfe);
  EXPECT_GT(found.alpha, 0.0);
  EXPECT_EQ(found.value, phi.Value(found.alpha));
  EXPECT_LE(found.value, start.value + options.sufficient_decrease * found.alpha * start.slope);
  EXPECT_LE(std::abs(phi.Slope()), options.curvature * std::abs(start.slope));
}

TEST(LineSearch, WolfePointsOfKnownFunctions) {
  Function functions[] = {
      {[](double a) { return (a - 3) * (a - 3); }, [](double a) { return 2 * (a - 3); }},
      {[](double a) { return std::cosh(a - 1); }, [](double a) { return std::sinh(a - 1); }},
      {[](double a) { return -a / (a * a + 2); }, [](double a) { return (a * a - 2) / ((a * a + 2) * (a * a + 2)); }},
      {[](double a) { return std::cos(a + 0.1) - 0.1 * a; }, [](double a) { return -std::sin(a + 0.1) - 0.1; }},
      // A penalty of slope 1e6 with a kink as narrow as that of the smooth penalties at w = 1e4.
      {[](double a) { return 1e6 * SmoothAbs(a - 0.37, 1e4).value; },
       [](double a) { return 1e6 * SmoothAbs(a - 0.37, 1e4).slope; }},
  };
  for (Function& phi : functions) {
    for (const double first : {1e-3, 0.1, 1.0, 10.0, 1e3}) {
      const LineStart start = phi.Start(first);
      ExpectWolfe(phi, start, SearchWolfe(phi, start, {}));
    }
  }
}

TEST(LineSearch, LargestStepIsTakenWhereTheFunctionStillFalls) {
  Function phi([](double a) { return -a; }, [](double) { return -1.0; });
  const LineSearchResult found = SearchWolfe(phi, phi.Start(1.0, 7.5), {});
  EXPECT_EQ(found.alpha, 7.5);
  EXPECT_FALSE(found.wolfe);
}

TEST(LineSearch, StaysWhereTheFunctionIsDefined) {
  Function phi([](double a) { return a > 0.2 ? std::nan("") : -a; }, [](double) { return -1.0; });
  const LineSearchResult found = SearchWolfe(phi, phi.Start(1.0), {});
  EXPECT_GT(found.alpha, 0.1);
  EXPECT_LE(found.alpha, 0.2);
}

TEST(LineSearch, GivesUpWhereNothingFalls) {
  // The given slope is wrong: the function increases.
  Function phi([](double a) { return a; }, [](double) { return -1.0; });
  const LineSearchResult found = SearchWolfe(phi, phi.Start(1.0), {});
  EXPECT_EQ(found.alpha, 0.0);
  EXPECT_EQ(phi.trials, LineSearchOptions{}.max_trials);
}

}  // namespace
}  // namespace legopt
