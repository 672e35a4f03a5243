// CMA-ES's distribution on the standard functions in ten variables, to 1e-10 from sigma = 0.5. For Rosenbrock's
// function, the documented run of pycma, by the method's author, takes 6,000 evaluations (cma.fmin from 0.1, without
// active update); here the median of nine seeds must not exceed this. No such run is documented for the others: their
// limits are 1.2 times the measured numbers (1,620; 4,350; rotated 4,310).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "legopt/solvers/internal/cma_es_solver.h"

namespace legopt {
namespace {

using BlackBox = std::function<double(const Eigen::VectorXd&)>;

struct BlackBoxDescent {
  Eigen::VectorXd mean;
  double lowest = 0.0;
  int evaluations = 0;
};

/// Minimizes until f < target or the evaluations are used up.
BlackBoxDescent MinimizeBlackBox(const BlackBox& f, const Eigen::VectorXd& start, int most_evaluations,
                                 unsigned seed = 1) {
  constexpr double kTarget = 1e-10;
  CovarianceAdaptation distribution;
  distribution.Reset(start.size(), CovarianceAdaptation::DefaultSamples(start.size()), 0.5);
  std::mt19937_64 generator(seed);
  const auto samples = static_cast<size_t>(distribution.num_samples());
  std::vector<double> values(samples);
  std::vector<int> order(samples);
  BlackBoxDescent descent{start, f(start), 0};
  while (descent.lowest > kTarget && descent.evaluations < most_evaluations) {
    distribution.Draw(generator);
    for (size_t k = 0; k < samples; ++k) values[k] = f(descent.mean + distribution.sample(static_cast<int>(k)));
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return values[static_cast<size_t>(a)] < values[static_cast<size_t>(b)]; });
    distribution.Update(order);
    descent.mean += distribution.mean_step();
    descent.evaluations += distribution.num_samples();
    descent.lowest = std::min(descent.lowest, values[static_cast<size_t>(order[0])]);
  }
  return descent;
}

double Sphere(const Eigen::VectorXd& x) { return x.squaredNorm(); }

double Ellipsoid(const Eigen::VectorXd& x) {
  double sum = 0.0;
  const double last = static_cast<double>(x.size() - 1);
  for (Eigen::Index i = 0; i < x.size(); ++i) sum += std::pow(1e6, static_cast<double>(i) / last) * x[i] * x[i];
  return sum;
}

/// Returns the ellipsoid in rotated axes, which only a full covariance can represent.
double RotatedEllipsoid(const Eigen::VectorXd& x) {
  Eigen::VectorXd mirror = Eigen::VectorXd::LinSpaced(x.size(), 1.0, 2.0).array().sin();
  mirror.normalize();
  return Ellipsoid(x - 2.0 * mirror.dot(x) * mirror);
}

double Rosenbrock(const Eigen::VectorXd& x) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i + 1 < x.size(); ++i) {
    sum += 100.0 * std::pow(x[i] * x[i] - x[i + 1], 2) + std::pow(x[i] - 1.0, 2);
  }
  return sum;
}

struct EvaluationBound {
  const char* name;
  double (*function)(const Eigen::VectorXd&);
  double start;
  int evaluations;  ///< limit of the median
};

class StandardFunctions : public ::testing::TestWithParam<EvaluationBound> {};

TEST_P(StandardFunctions, TakeFewEvaluations) {
  const EvaluationBound& reference = GetParam();
  const int most = reference.evaluations;
  constexpr int kSeeds = 9;
  std::vector<int> counts;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const BlackBoxDescent descent =
        MinimizeBlackBox(reference.function, Eigen::VectorXd::Constant(10, reference.start), 4 * most, seed);
    if (descent.lowest <= 1e-10) counts.push_back(descent.evaluations);
  }
  ASSERT_GT(counts.size(), static_cast<size_t>(kSeeds / 2)) << "Rosenbrock has a local minimum; most runs avoid it";
  std::sort(counts.begin(), counts.end());
  RecordProperty("median_evaluations", counts[counts.size() / 2]);
  EXPECT_LE(counts[counts.size() / 2], most);
}

INSTANTIATE_TEST_SUITE_P(TenVariables, StandardFunctions,
                         ::testing::Values(EvaluationBound{"Sphere", Sphere, 1.0, 1950},
                                           EvaluationBound{"Ellipsoid", Ellipsoid, 1.0, 5220},
                                           EvaluationBound{"RotatedEllipsoid", RotatedEllipsoid, 1.0, 5220},
                                           EvaluationBound{"Rosenbrock", Rosenbrock, 0.1, 6000}),
                         [](const auto& reference) { return std::string(reference.param.name); });

TEST(CovarianceAdaptation, LearnsTheInverseOfTheHessian) {
  CovarianceAdaptation distribution;
  constexpr int kSize = 4;
  distribution.Reset(kSize, CovarianceAdaptation::DefaultSamples(kSize), 0.5);
  std::mt19937_64 generator(2);
  const auto samples = static_cast<size_t>(distribution.num_samples());
  std::vector<double> values(samples);
  std::vector<int> order(samples);
  Eigen::VectorXd mean = Eigen::VectorXd::Ones(kSize);
  for (int generation = 0; generation < 400; ++generation) {
    distribution.Draw(generator);
    for (size_t k = 0; k < samples; ++k) values[k] = Ellipsoid(mean + distribution.sample(static_cast<int>(k)));
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return values[static_cast<size_t>(a)] < values[static_cast<size_t>(b)]; });
    distribution.Update(order);
    mean += distribution.mean_step();
  }
  // Axes of curvature 1 : 1e6 have deviations of 1000 : 1.
  const double ratio = distribution.deviation(0) / distribution.deviation(kSize - 1);
  EXPECT_GT(ratio, 1000.0 / 3.0);
  EXPECT_LT(ratio, 1000.0 * 3.0);
}

TEST(CovarianceAdaptation, OneVariable) {
  const BlackBoxDescent descent = MinimizeBlackBox(Sphere, Eigen::VectorXd::Ones(1), 1000);
  EXPECT_LE(descent.lowest, 1e-10);
}

TEST(CovarianceAdaptation, RepeatsToTheBit) {
  const Eigen::VectorXd start = Eigen::VectorXd::Constant(5, 0.7);
  const BlackBoxDescent a = MinimizeBlackBox(Rosenbrock, start, 2000, 5),
                        b = MinimizeBlackBox(Rosenbrock, start, 2000, 5);
  EXPECT_EQ(a.mean, b.mean);
  EXPECT_EQ(a.lowest, b.lowest);
  EXPECT_NE(MinimizeBlackBox(Rosenbrock, start, 2000, 6).lowest, a.lowest);
}

}  // namespace
}  // namespace legopt
