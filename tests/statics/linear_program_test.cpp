// Random programs against GLPK, proofs of infeasibility, degenerate and cycling programs, programs that change.
#include "legopt/statics/internal/linear_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/statics/reference_program.h"

namespace legopt {
namespace {

constexpr double kInfinity = LinearProgramSolver::kInfinity;

struct Program : LinearProgram {
  Eigen::VectorXd c;
};

/// Equations with any column within [0, upper].
Program Equations(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  Program program;
  program.A = A;
  program.b = b;
  program.range.setZero(b.size());
  program.upper.setConstant(A.cols(), kInfinity);
  program.c.setZero(A.cols());
  return program;
}

/// Small integers, so that many programs are degenerate, redundant or infeasible.
Program RandomProgram(std::mt19937_64& random) {
  const auto integer = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  const int m = integer(1, 6), n = integer(2, 14);
  Program program;
  program.A.setZero(m, n);
  program.b.setZero(m);
  program.range.setZero(m);
  program.c.setZero(n);
  program.upper.setConstant(n, kInfinity);
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) program.A(i, j) = integer(0, 2) == 0 ? 0.0 : integer(-3, 3);
    program.b[i] = integer(-4, 6);
    const int kind = integer(0, 3);
    if (kind == 0) program.range[i] = integer(1, 5);
    if (kind == 1) program.range[i] = kInfinity;
  }
  if (m > 1 && integer(0, 3) == 0) {
    program.A.row(1) = program.A.row(0);
    program.b[1] = program.b[0];
  }
  for (int j = 0; j < n; ++j) {
    program.c[j] = integer(-3, 5);
    if (integer(0, 2) == 0) program.upper[j] = integer(1, 4);
  }
  return program;
}

test::ReferenceProgram ForGlpk(const Program& program) {
  return {.A = program.A,
          .lower = program.b - program.range,
          .upper = program.b,
          .columns_upper = program.upper,
          .c = program.c};
}

void ExpectFeasible(const Program& program, const Eigen::VectorXd& x) {
  const Eigen::VectorXd slack = program.b - program.A * x;
  EXPECT_GT(slack.minCoeff(), -1e-9);
  EXPECT_LT((slack - program.range).maxCoeff(), 1e-9);
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    EXPECT_GE(x[j], 0.0);
    EXPECT_LE(x[j], program.upper[j]);
  }
}

void ExpectProof(const Program& program, const Eigen::VectorXd& y) {
  double bounded = 0.0;
  for (Eigen::Index j = 0; j < program.upper.size(); ++j) {
    const double product = y.dot(program.A.col(j));
    if (std::isfinite(program.upper[j])) {
      bounded += program.upper[j] * std::max(0.0, product);
    } else {
      EXPECT_LT(product, 1e-9);
    }
  }
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (std::isfinite(program.range[i])) {
      bounded += program.range[i] * std::max(0.0, y[i]);
    } else {
      EXPECT_LT(y[i], 1e-9);
    }
  }
  EXPECT_GT(y.dot(program.b), bounded + 1e-6);
}

TEST(LinearProgram, AgreesWithGlpkAndProvesInfeasibility) {
  std::mt19937_64 random(7);
  LinearProgramSolver solver;
  int optimal = 0, infeasible = 0, unbounded = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    SCOPED_TRACE(trial);
    const Program program = RandomProgram(random);
    const std::optional<double> expected = test::MinimumByGlpk(ForGlpk(program));
    const LinearProgramStatus feasible = solver.Constrain(program);
    if (!expected) {
      ASSERT_EQ(feasible, LinearProgramStatus::kInfeasible);
      ExpectProof(program, solver.multipliers());
      ++infeasible;
      continue;
    }
    ASSERT_EQ(feasible, LinearProgramStatus::kOptimal);
    ExpectFeasible(program, solver.x());
    const LinearProgramStatus status = solver.Minimize(program.c);
    if (std::isinf(*expected)) {
      EXPECT_EQ(status, LinearProgramStatus::kUnbounded);
      ++unbounded;
      continue;
    }
    ASSERT_EQ(status, LinearProgramStatus::kOptimal);
    EXPECT_NEAR(solver.objective(), *expected, 1e-7);
    EXPECT_NEAR(solver.objective(), program.c.dot(solver.x()), 1e-12);
    ExpectFeasible(program, solver.x());
    ++optimal;
  }
  EXPECT_GT(optimal, 500);
  EXPECT_GT(infeasible, 300);
  EXPECT_GT(unbounded, 300);
}

TEST(LinearProgram, MultipliersAreRatesOfTheOptimum) {
  Program program = Equations((Eigen::MatrixXd(2, 2) << 1, 1, 1, 3).finished(), Eigen::Vector2d(4, 6));
  program.range.setConstant(kInfinity);
  program.c << -3, -5;
  LinearProgramSolver solver;
  ASSERT_EQ(solver.Constrain(program), LinearProgramStatus::kOptimal);
  ASSERT_EQ(solver.Minimize(program.c), LinearProgramStatus::kOptimal);
  EXPECT_NEAR(solver.objective(), -14.0, 1e-12);  // at (3, 1)
  EXPECT_NEAR(solver.multipliers()[0], -2.0, 1e-12);
  EXPECT_NEAR(solver.multipliers()[1], -1.0, 1e-12);
}

/// Programs in which Dantzig's rule with a careless ratio test cycles.
TEST(LinearProgram, ProgramsThatCycleEnd) {
  struct Cycling {
    Eigen::MatrixXd A;
    Eigen::VectorXd c;
  };
  // Beale, 1955; Chvatal, 1983, page 31; Marshall and Suurballe, 1969.
  const std::vector<Cycling> programs = {
      {(Eigen::MatrixXd(3, 4) << 0.25, -60, -0.04, 9, 0.5, -90, -0.02, 3, 0, 0, 1, 0).finished(),
       Eigen::Vector4d(-0.75, 150, -0.02, 6)},
      {(Eigen::MatrixXd(3, 4) << 0.5, -5.5, -2.5, 9, 0.5, -1.5, -0.5, 1, 1, 0, 0, 0).finished(),
       Eigen::Vector4d(-10, 57, 9, 24)},
      {(Eigen::MatrixXd(3, 4) << 0.5, -5.5, -2.5, 9, 0.5, -1.5, -0.5, 1, 1, 1, 1, 1).finished(),
       Eigen::Vector4d(-1, 7, 1, 2)}};
  for (const Cycling& cycling : programs) {
    Program program = Equations(cycling.A, Eigen::Vector3d(0, 0, 1));
    program.range.setConstant(kInfinity);
    program.c = cycling.c;
    LinearProgramSolver solver;
    ASSERT_EQ(solver.Constrain(program), LinearProgramStatus::kOptimal);
    ASSERT_EQ(solver.Minimize(program.c), LinearProgramStatus::kOptimal);
    EXPECT_NEAR(solver.objective(), test::MinimumByGlpk(ForGlpk(program)).value(), 1e-12);
  }
}

TEST(LinearProgram, SecondObjectiveStartsFromTheFirstOptimum) {
  std::mt19937_64 random(3);
  LinearProgramSolver solver, fresh;
  int compared = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Program program = RandomProgram(random);
    program.upper = program.upper.cwiseMin(10.0);  // bounded
    if (solver.Constrain(program) != LinearProgramStatus::kOptimal) continue;
    ASSERT_EQ(solver.Minimize(program.c), LinearProgramStatus::kOptimal);
    ASSERT_EQ(solver.Minimize(-program.c), LinearProgramStatus::kOptimal);
    ASSERT_EQ(fresh.Constrain(program), LinearProgramStatus::kOptimal);
    ASSERT_EQ(fresh.Minimize(-program.c), LinearProgramStatus::kOptimal);
    EXPECT_NEAR(solver.objective(), fresh.objective(), 1e-9);
    ++compared;
  }
  EXPECT_GT(compared, 50);
}

TEST(LinearProgram, ResumesWithAnyOtherNumbers) {
  std::mt19937_64 random(5);
  LinearProgramSolver solver, fresh;
  int optimal = 0, infeasible = 0, pivots = 0, fresh_pivots = 0;
  for (int trial = 0; trial < 1'000; ++trial) {
    SCOPED_TRACE(trial);
    Program program = RandomProgram(random);
    if (solver.Constrain(program) != LinearProgramStatus::kOptimal) continue;
    if (solver.Minimize(program.c) != LinearProgramStatus::kOptimal) continue;
    std::uniform_real_distribution<double> change(-0.3, 0.3);
    for (Eigen::Index i = 0; i < program.A.size(); ++i) {
      if (program.A.data()[i] != 0.0) program.A.data()[i] += 0.1 * change(random);
    }
    for (Eigen::Index i = 0; i < program.b.size(); ++i) program.b[i] += change(random);
    const LinearProgramStatus feasible = fresh.Constrain(program);
    fresh_pivots += fresh.pivots();
    ASSERT_EQ(solver.Resume(program), feasible);
    pivots += solver.pivots();
    if (feasible == LinearProgramStatus::kInfeasible) {
      ExpectProof(program, solver.multipliers());
      ++infeasible;
      continue;
    }
    ExpectFeasible(program, solver.x());
    const LinearProgramStatus expected = fresh.Minimize(program.c);
    ASSERT_EQ(solver.Minimize(program.c), expected);
    if (expected != LinearProgramStatus::kOptimal) continue;
    ExpectFeasible(program, solver.x());
    EXPECT_NEAR(solver.objective(), fresh.objective(), 1e-8 * (1.0 + std::abs(fresh.objective())));
    ++optimal;
  }
  EXPECT_GT(optimal, 200);
  EXPECT_GT(infeasible, 10);
  EXPECT_LT(2 * pivots, fresh_pivots);
}

TEST(LinearProgram, ResumesFromABasisThatBecameSingular) {
  Program program = Equations(Eigen::Matrix2d::Identity(), Eigen::Vector2d(1, 2));
  LinearProgramSolver solver;
  ASSERT_EQ(solver.Constrain(program), LinearProgramStatus::kOptimal);
  program.A << 1, 1, 1, 1;
  EXPECT_EQ(solver.Resume(program), LinearProgramStatus::kInfeasible);
  ExpectProof(program, solver.multipliers());
  program.b = Eigen::Vector2d(2, 2);
  ASSERT_EQ(solver.Resume(program), LinearProgramStatus::kOptimal);
  ExpectFeasible(program, solver.x());
}

TEST(LinearProgram, ResumesFromABasisWhosePivotBecameRounding) {
  Program program = Equations(Eigen::Matrix2d::Identity(), Eigen::Vector2d(1, 1));
  LinearProgramSolver solver, fresh;
  ASSERT_EQ(solver.Constrain(program), LinearProgramStatus::kOptimal);
  program.A << 6e-17, 0, 0, 1;  // the cosine of a right angle, for example
  program.range.setConstant(kInfinity);
  program.upper.setConstant(4);
  program.b = Eigen::Vector2d(0, 1);
  program.c = Eigen::Vector2d(-1, 0);
  ASSERT_EQ(solver.Resume(program), fresh.Constrain(program));
  ASSERT_EQ(solver.Minimize(program.c), LinearProgramStatus::kOptimal);
  ExpectFeasible(program, solver.x());
  EXPECT_NEAR(solver.objective(), -4.0, 1e-12);
}

TEST(LinearProgram, EndsIfAColumnHasOnlyEntriesBelowTheTolerance) {
  Program program = Equations(Eigen::MatrixXd::Constant(1, 1, 5e-10), Eigen::VectorXd::Ones(1));
  LinearProgramSolver solver;
  EXPECT_EQ(solver.Constrain(program), LinearProgramStatus::kStalled);
  EXPECT_EQ(solver.Resume(program), LinearProgramStatus::kStalled);
}

TEST(LinearProgram, NumbersThatAreNotFiniteAreNoSolution) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Program good = Equations(Eigen::MatrixXd::Ones(2, 3), Eigen::Vector2d(1, 1));
  for (int place = 0; place < 3; ++place) {
    LinearProgramSolver solver;
    Program bad = good;
    if (place == 0) bad.A(1, 2) = kNaN;
    if (place == 1) bad.b[1] = kNaN;
    if (place == 2) bad.upper[0] = kNaN;
    const bool constrained = solver.Constrain(bad) == LinearProgramStatus::kOptimal;
    EXPECT_FALSE(constrained && solver.Minimize(Eigen::Vector3d(-2, -1, -1)) == LinearProgramStatus::kOptimal) << place;
    ASSERT_EQ(solver.Constrain(good), LinearProgramStatus::kOptimal) << "an earlier program leaves no trace";
    EXPECT_EQ(solver.Minimize(Eigen::Vector3d(kNaN, 0, 0)), LinearProgramStatus::kStalled);
    EXPECT_EQ(solver.Minimize(Eigen::Vector3d(-1, 0, 0)), LinearProgramStatus::kOptimal);
  }
}

/// Rows that are almost linearly dependent, so that a basis may be almost singular.
TEST(LinearProgram, AlmostDependentRowsGiveNoFalseSolution) {
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal;
  LinearProgramSolver solver;
  int optimal = 0;
  for (int trial = 0; trial < 1'000; ++trial) {
    SCOPED_TRACE(trial);
    const double apart = std::pow(10.0, -(trial % 14));
    Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(3, 6, [&] { return normal(random); });
    A.row(2) = A.row(0) + apart * A.row(2);
    const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(6, [&] { return std::abs(normal(random)); });
    Program program = Equations(A, A * x);
    program.upper.setConstant(4.0);
    program.c = Eigen::VectorXd::NullaryExpr(6, [&] { return normal(random); });
    if (solver.Resume(program) != LinearProgramStatus::kOptimal) continue;
    ExpectFeasible(program, solver.x());
    if (solver.Minimize(program.c) != LinearProgramStatus::kOptimal) continue;
    ExpectFeasible(program, solver.x());
    EXPECT_NEAR(DualBound(program, program.c, solver.multipliers(), 4.0), solver.objective(),
                1e-7 * (1.0 + solver.multipliers().cwiseAbs().maxCoeff()));
    ++optimal;
  }
  EXPECT_GT(optimal, 800);
}

TEST(LinearProgram, ResumesAnotherSizeFromTheBeginning) {
  LinearProgramSolver solver;
  for (const int columns : {2, 3, 1}) {
    const Program program =
        Equations(Eigen::MatrixXd::Ones(1, columns), Eigen::VectorXd::Constant(1, static_cast<double>(columns)));
    ASSERT_EQ(solver.Resume(program), LinearProgramStatus::kOptimal);
    ExpectFeasible(program, solver.x());
  }
}

TEST(LinearProgram, TurnVisitsTheOptimaOfAllDirections) {
  constexpr int kPrograms = 300, kDirections = 24;
  constexpr double kSame = 1e-8;
  std::mt19937_64 random(5);
  int turned = 0;
  for (int trial = 0; trial < kPrograms; ++trial) {
    Program program = RandomProgram(random);
    program.upper = program.upper.cwiseMin(4.0);  // an optimum in every direction
    const Eigen::VectorXd second = RandomProgram(random).c.head(1).replicate(program.c.size(), 1) - program.c.reverse();
    LinearProgramSolver solver;
    if (solver.Constrain(program) != LinearProgramStatus::kOptimal) continue;
    ASSERT_EQ(solver.Minimize(program.c), LinearProgramStatus::kOptimal);
    std::vector<Eigen::VectorXd> corners;
    double last_angle = 0.0;
    const auto visit = [&](const TurnedOptimum& optimum) {
      EXPECT_GE(optimum.angle, last_angle) << trial;
      last_angle = optimum.angle;
      ExpectFeasible(program, optimum.x);
      corners.push_back(optimum.x);
      return true;
    };
    ASSERT_EQ(solver.Turn(program.c, second, visit), LinearProgramStatus::kOptimal) << trial;
    ++turned;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      const Eigen::VectorXd cost = std::cos(angle) * program.c + std::sin(angle) * second;
      LinearProgramSolver fresh;
      ASSERT_EQ(fresh.Constrain(program), LinearProgramStatus::kOptimal);
      ASSERT_EQ(fresh.Minimize(cost), LinearProgramStatus::kOptimal);
      double least = kInfinity;
      for (const Eigen::VectorXd& x : corners) least = std::min(least, cost.dot(x));
      EXPECT_NEAR(least, fresh.objective(), kSame) << trial << ", direction " << k;
    }
  }
  EXPECT_GT(turned, kPrograms / 10);
}

TEST(LinearProgram, TurnEndsWhenItsVisitorSaysSo) {
  LinearProgramSolver solver;
  Program square = Equations(Eigen::MatrixXd::Ones(1, 2), Eigen::VectorXd::Constant(1, 2.0));
  square.range.setConstant(kInfinity);
  square.upper.setOnes();
  ASSERT_EQ(solver.Constrain(square), LinearProgramStatus::kOptimal);
  ASSERT_EQ(solver.Minimize(Eigen::Vector2d(-1, 0)), LinearProgramStatus::kOptimal);
  int visits = 0;
  const auto visit = [&](const TurnedOptimum&) { return ++visits < 2; };
  EXPECT_EQ(solver.Turn(Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, -1), visit), LinearProgramStatus::kOptimal);
  EXPECT_EQ(visits, 2);
}

}  // namespace
}  // namespace legopt
