// Solves one posture of a dataset by the best method and judges it: solve_posture DATASET [PROBLEM]
#include <cstdio>
#include <cstdlib>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/types/input_error.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: solve_posture DATASET [PROBLEM]\n");
    return 2;
  }
  try {
    const auto dataset = legopt::Dataset::Load(argv[1]);
    const auto task = legopt::Task::kPosture;
    const int id = argc > 2 ? std::atoi(argv[2]) : dataset->problems(task).front().id;

    legopt::ProblemSolver solver(dataset);
    const legopt::Method method = legopt::Method::Of("best");
    const legopt::SolveOutcome outcome = solver.Solve(task, id, legopt::Initialization::kGood, method, {});

    // Success is decided by the judge, not by the solver's status.
    legopt::Judge judge(dataset);
    const legopt::Evaluation evaluation = judge.Evaluate(task, dataset->problem(task, id), outcome.waypoints);
    std::printf("posture %d: %s, cost %.1f (N m)^2, %.2f ms\n", id, ToString(evaluation.literal).data(),
                evaluation.cost, static_cast<double>(outcome.wall_us) / 1e3);
    return evaluation.literal == legopt::Verdict::kSuccess ? 0 : 1;
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
