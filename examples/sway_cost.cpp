// Computes the cost of balance for an unobstructed motion: sway_cost DATASET [DESCENTS]
//
// Solves the motions of the dataset as tasks `motion` and `balanced` (docs/explanation/judge.md#continuous-motions),
// both without collisions, in separate pieces of six stances. The cheapest postures of each piece are searched by
// DESCENTS descents (default 4), the first from the initial guess, the others from near the best so far. Prints the
// cost per waypoint as the judge computes it, squared steps of the joints; segments between pieces are not included.
// Exits with 1 if a piece has no solution, with 2 on wrong usage.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <span>

#include "legopt/geometry/collision_query.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/types/input_error.h"

namespace {

constexpr size_t kStances = 6;

struct Setting {
  const legopt::Dataset& dataset;
  legopt::CollisionQuery& query;
  legopt::Solver& solver;
  int descents;
};

// Returns the sum of the squared joint steps, rad^2.
double JointSteps(const Eigen::VectorXd& x, Eigen::Index size, int num_joints) {
  double sum = 0.0;
  for (Eigen::Index t = size; t < x.size(); t += size) {
    sum += (x.segment(t, num_joints) - x.segment(t - size, num_joints)).squaredNorm();
  }
  return sum;
}

legopt::Method Descent() {
  legopt::Method method = legopt::Method::Of("best");
  // Free iterations would enable the disabled terms again.
  method.options.As<legopt::BestOptions>().free_iterations = 0;
  return method;
}

// Returns infinity if no descent converged to a feasible point.
double CheapestPiece(const Setting& setting, legopt::Task task, std::span<const legopt::Stance> stances) {
  const auto program = legopt::MakeTaskProgram(task, setting.dataset, setting.query, stances,
                                               {.continuous = legopt::ContinuousCollision::kNone});
  for (const auto& term : program->terms()) term->SetDisabled(true);  // disables the collision terms
  const Eigen::Index size = program->point_size();
  Eigen::VectorXd best(program->num_waypoints() * size);
  for (int t = 0; t < program->num_waypoints(); ++t) {
    const legopt::Stance& stance = stances[static_cast<size_t>(legopt::StanceOfWaypoint(task, t))];
    best.segment(t * size, size) = InitialGuess(setting.dataset, stance, legopt::Initialization::kGood);
  }
  std::mt19937_64 generator(1);
  double least = std::numeric_limits<double>::infinity();
  for (int descent = 0; descent < setting.descents; ++descent) {
    Eigen::VectorXd x = best;
    for (int t = 0; descent > 0 && t < program->num_waypoints(); ++t) {
      constexpr double kNoise_rad = 0.3;
      PerturbJoints(setting.dataset.robot(), generator, kNoise_rad, x.segment(t * size, size));
    }
    const legopt::SolverResult result = setting.solver.Solve(*program, x, {nullptr, &generator});
    const double steps = JointSteps(x, size, setting.dataset.robot().num_dofs());
    if (!result.feasible || steps >= least) continue;
    least = steps;
    best = x;
  }
  return least;
}

double CheapestMotion(const Setting& setting, legopt::Task task, const legopt::ProblemDefinition& motion) {
  const std::span<const legopt::Stance> stances(motion.stances);
  double sum = 0.0;
  for (size_t first = 0; first < stances.size(); first += kStances) {
    sum += CheapestPiece(setting, task, stances.subspan(first, std::min(kStances, stances.size() - first)));
  }
  return sum / legopt::NumWaypoints(task, static_cast<int>(stances.size()));
}

}  // namespace

int main(int argc, char** argv) {
  const int descents = argc == 3 ? std::atoi(argv[2]) : 4;
  if (argc < 2 || argc > 3 || descents < 1) {
    std::fprintf(stderr, "usage: sway_cost DATASET [DESCENTS]\n");
    return 2;
  }
  try {
    const auto dataset = legopt::Dataset::Load(argv[1]);
    legopt::CollisionQuery query(dataset->collision_model());
    const auto solver = MakeSolver(Descent());
    const Setting setting{*dataset, query, *solver, descents};
    const auto& motions = dataset->problems(legopt::Task::kMotion);
    double motion_sum = 0.0, balanced_sum = 0.0;
    for (const legopt::ProblemDefinition& problem : motions) {
      const double motion = CheapestMotion(setting, legopt::Task::kMotion, problem);
      const double balanced = CheapestMotion(setting, legopt::Task::kBalanced, problem);
      std::printf("motion %d, %zu stances: %.3f, balanced %.3f\n", problem.id, problem.stances.size(), motion,
                  balanced);
      motion_sum += motion;
      balanced_sum += balanced;
    }
    const auto count = static_cast<double>(motions.size());
    std::printf("mean of %zu: %.3f, balanced %.3f\n", motions.size(), motion_sum / count, balanced_sum / count);
    return std::isfinite(motion_sum + balanced_sum) ? 0 : 1;
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
