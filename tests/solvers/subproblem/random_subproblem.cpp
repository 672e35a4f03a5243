#include "tests/solvers/subproblem/random_subproblem.h"

#include <algorithm>
#include <random>

namespace legopt {
namespace {

LinearModel RandomModel(std::mt19937& generator, int rows, int size, int num_waypoints, double offset) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> third(0, 2);
  LinearModel model;
  model.Reset(rows, size, num_waypoints);
  for (int i = 0; i < rows; ++i) {
    model.value(i) = offset * normal(generator);
    for (int k = 0; k < num_waypoints; ++k) {
      for (int j = 0; j < size; ++j) model.row(k, i)[j] = third(generator) == 0 ? 0.0 : 0.5 * normal(generator);
    }
  }
  return model;
}

/// Keeps the coefficients of the base, the last six variables, and of the joints of a chain: six for a foot's rows, up
/// to ten for a contact's.
void KeepChain(std::mt19937& generator, LinearModel& model, int size, int first_row, int rows, bool foot) {
  constexpr int kBase = 6, kLeg = 6;
  const int first = foot ? 4 + 6 * (static_cast<int>(generator()) & 1) : static_cast<int>(generator() % 20);
  const int joints = foot ? kLeg : 1 + static_cast<int>(generator() % 10);
  for (int i = first_row; i < first_row + rows; ++i) {
    for (int k = 0; k < model.num_waypoints(); ++k) {
      for (int j = 0; j < size - kBase; ++j) {
        if (j < first || j >= first + joints) model.row(k, i)[j] = 0.0;
      }
    }
  }
}

/// Keeps chains in the rows of feet, six each.
void KeepFeet(std::mt19937& generator, LinearModel& model, int size) {
  constexpr int kFoot = 6;
  for (int i = 0; i < model.rows(); i += kFoot) {
    KeepChain(generator, model, size, i, std::min(kFoot, model.rows() - i), true);
  }
}

/// Keeps chains in the rows of contacts, except in the first rows.
void KeepContacts(std::mt19937& generator, LinearModel& model, int size) {
  constexpr int kBalance = 5;
  for (int i = kBalance; i < model.rows(); ++i) KeepChain(generator, model, size, i, 1, false);
}

// x of the next block minus x of this one, plus the previous difference.
LinearModel Steps(std::mt19937& generator, int size) {
  std::normal_distribution<double> normal;
  LinearModel model;
  model.Reset(size, size, 2);
  for (int i = 0; i < size; ++i) {
    model.value(i) = 0.1 * normal(generator);
    model.row(0, i)[i] = -1.0;
    model.row(1, i)[i] = 1.0;
  }
  return model;
}

}  // namespace

ConvexSubproblem MakeRandomSubproblem(const RandomSubproblemShape& shape, unsigned seed) {
  std::mt19937 generator(seed);
  ConvexSubproblem problem(shape.num_blocks, shape.block_size);
  const int n = shape.block_size;
  for (int t = 0; t < shape.num_blocks; ++t) {
    problem.AddCost(t, RandomModel(generator, shape.cost_rows, n, 1, 1.0));
    LinearModel equalities = RandomModel(generator, shape.equality_rows, n, 1, 0.05);
    if (shape.chains) KeepFeet(generator, equalities, n);
    problem.AddPenalties(t, equalities, TermKind::kEquality, shape.weight);
    LinearModel inequalities = RandomModel(generator, shape.inequality_rows, n, 1, 0.1);
    if (shape.chains) KeepContacts(generator, inequalities, n);
    problem.AddPenalties(t, inequalities, TermKind::kInequality, shape.weight);
    if (!shape.coupled || t + 1 == shape.num_blocks) continue;
    problem.AddCost(t, shape.steps ? Steps(generator, n) : RandomModel(generator, n, n, 2, 0.2));
    if (shape.pair_rows == 0) continue;
    problem.AddPenalties(t, RandomModel(generator, shape.pair_rows, n, 2, 0.1), TermKind::kInequality, shape.weight);
  }
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(shape.num_blocks * n, -shape.box);
  Eigen::VectorXd upper = -lower;
  lower[n - 1] = 0.0;  // a joint at its limit
  for (int i = 0; i < shape.fixed_variables; ++i) lower[i] = upper[i] = 0.0;
  problem.SetBounds(lower, upper);
  return problem;
}

}  // namespace legopt
