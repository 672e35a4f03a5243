// A custom solver, registered outside of legopt and used as a method like any other: own_solver DATASET
//
// Gauss-Newton on cost and violated constraints with a fixed penalty and damping: not competitive, but only forty
// lines.
#include <Eigen/Cholesky>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/input_error.h"

namespace {

// Options are a struct that lists its fields once, for parsing, checking, writing and hashing.
struct GaussNewtonOptions {
  int max_iterations = 100;
  double penalty = 1e6;
  double damping = 1.0;

  static void Visit(auto& options, auto& fields) {
    fields.Integer("max_iterations", options.max_iterations, 1, 10000);
    fields.Number("penalty", options.penalty, 1.0, 1e12);
    fields.Number("damping", options.damping, 1e-9, 1e3);
  }
};

class GaussNewtonSolver : public legopt::Solver {
 public:
  explicit GaussNewtonSolver(const GaussNewtonOptions& options) : options_(options) {}

  legopt::SolverResult Solve(legopt::Program& program, Eigen::VectorXd& x,
                             const legopt::SolverContext& context) override {
    const int size = program.num_waypoints() * program.tangent_size();
    Eigen::VectorXd lower(size), upper(size), x_next(x.size());
    legopt::SolverResult result;
    program.ProjectOnBounds(x);
    for (; result.iterations < options_.max_iterations && !context.Stopped(); ++result.iterations) {
      program.SetPoint(x);
      Eigen::MatrixXd hessian = options_.damping * Eigen::MatrixXd::Identity(size, size);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
      for (const auto& term : program.terms()) Add(*term, program.tangent_size(), hessian, gradient);
      program.StepBounds(x, lower, upper);
      const Eigen::VectorXd step = (-hessian.ldlt().solve(gradient)).cwiseMax(lower).cwiseMin(upper);
      program.Retract(x, step, x_next);
      x = x_next;
      if (step.lpNorm<Eigen::Infinity>() < 1e-6) break;
    }
    result.value = legopt::EvaluateObjective(program, x, residuals_);
    result.feasible = result.value.max_violation < 1e-3;
    result.status =
        result.feasible ? legopt::SolveStatus::kConvergedFeasible : legopt::SolveStatus::kConvergedInfeasible;
    return result;
  }

 private:
  void Add(legopt::Term& term, int tangent_size, Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) {
    const legopt::TermShape& shape = term.shape();
    term.Linearize(model_);
    for (int i = 0; i < model_.rows(); ++i) {
      const bool one_sided = shape.kind != legopt::TermKind::kCost && shape.kind != legopt::TermKind::kEquality;
      if (one_sided && model_.value(i) <= 0) continue;
      const double weight = shape.kind == legopt::TermKind::kCost ? 1.0 : options_.penalty;
      const Eigen::Map<const Eigen::VectorXd> row(model_.row(0, i), tangent_size);  // a posture has one waypoint
      hessian.noalias() += weight * row * row.transpose();
      gradient.noalias() += weight * model_.value(i) * row;
    }
  }

  GaussNewtonOptions options_;
  legopt::LinearModel model_;
  std::vector<double> residuals_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: own_solver DATASET\n");
    return 2;
  }
  try {
    legopt::SolverRegistry registry;
    registry.Register<GaussNewtonOptions>(
        {.word = "gauss_newton", .paper_name = "Gauss-Newton", .contact_range_m = 1e-3},
        [](const GaussNewtonOptions& options, const legopt::Sampling&) {
          return std::make_unique<GaussNewtonSolver>(options);
        });
    const auto method = legopt::Method::FromJson({{"solver", "gauss_newton"}, {"multi_starts", 10}}, "own", registry);

    const auto dataset = legopt::Dataset::Load(argv[1]);
    legopt::ProblemSolver solver(dataset, registry);
    legopt::Judge judge(dataset);
    int good = 0;
    const auto task = legopt::Task::kPosture;
    for (const legopt::ProblemDefinition& problem : dataset->problems(task)) {
      const auto outcome = solver.Solve(task, problem, legopt::Initialization::kGood, method, {});
      good += judge.Evaluate(task, problem, outcome.waypoints).literal == legopt::Verdict::kSuccess ? 1 : 0;
    }
    std::printf("%s, %s: %d of %zu postures\n", method.name.c_str(), method.Hash().substr(0, 12).c_str(), good,
                dataset->problems(task).size());
    return good > 0 ? 0 : 1;
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
