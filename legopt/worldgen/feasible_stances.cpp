#include "legopt/worldgen/feasible_stances.h"

#include <algorithm>
#include <set>
#include <string>

#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/stance_sampler.h"

namespace legopt::worldgen {

std::vector<Stance> ReadFeasibleStances(const std::shared_ptr<const Dataset>& dataset,
                                        const std::filesystem::path& path) {
  const SolutionFile file = ReadSolutions(path);
  Judge judge(dataset);
  const auto accepted = [&judge](const ProblemDefinition& problem, const Solution& solution) {
    const Evaluation evaluation = judge.Evaluate(kStanceTask, problem, solution.waypoints);
    return evaluation.literal == Verdict::kSuccess && evaluation.strict == Verdict::kSuccess;
  };
  std::vector<Stance> stances;
  std::set<std::string> known;
  const std::string word(ToString(kStanceTask));
  for (const SolvedProblem& problem : file.problems) {
    const ProblemDefinition& definition = problem.definition;
    if (!Fits(kStanceTask, definition)) {
      throw InputError({path.string(), "problem " + std::to_string(definition.id),
                        std::to_string(definition.stances.size()) + " stances", "is no " + word + " problem",
                        "export the solutions with --task " + word});
    }
    const bool proven = std::any_of(problem.solutions.begin(), problem.solutions.end(),
                                    [&](const Solution& solution) { return accepted(definition, solution); });
    if (proven && known.insert(FormatStance(definition.stances.front())).second) {
      stances.push_back(definition.stances.front());
    }
  }
  if (stances.empty()) {
    throw InputError({path.string(), "problems", std::to_string(file.problems.size()),
                      "no stance has a solution that the judge accepts",
                      "check that the solutions were made with this dataset"});
  }
  return stances;
}

}  // namespace legopt::worldgen
