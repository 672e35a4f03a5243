// Judges every solution of a LegOpt solution file: judge_file DATASET SOLUTIONS.json
#include <cstdio>

#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/input_error.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: judge_file DATASET SOLUTIONS.json\n");
    return 2;
  }
  try {
    const auto dataset = legopt::Dataset::Load(argv[1]);
    const legopt::SolutionFile file = legopt::ReadSolutions(argv[2]);
    legopt::Judge judge(dataset);
    int good = 0, all = 0;
    for (const legopt::SolvedProblem& problem : file.problems) {
      const legopt::ProblemDefinition& definition = dataset->problem(file.task, problem.definition.id);
      for (const legopt::Solution& solution : problem.solutions) {
        const legopt::Evaluation evaluation = judge.Evaluate(file.task, definition, solution.waypoints);
        std::printf("%d %s: %s %s\n", definition.id, solution.method.c_str(), ToString(evaluation.literal).data(),
                    evaluation.detail.c_str());
        ++all;
        good += evaluation.literal == legopt::Verdict::kSuccess ? 1 : 0;
      }
    }
    std::printf("%d of %d solutions are feasible\n", good, all);
    return good == all ? 0 : 1;
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
