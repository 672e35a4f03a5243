#include "legopt/planning/problem_solver.h"

#include <utility>

#include "legopt/planning/internal/problem_run.h"

namespace legopt {

ProblemSolver::ProblemSolver(std::shared_ptr<const Dataset> dataset, SolverRegistry registry)
    : dataset_(std::move(dataset)), registry_(std::move(registry)) {
  Query(SceneRepresentation::kSolid, PairSelection::kReference);
}

CollisionQuery& ProblemSolver::Query(SceneRepresentation representation, PairSelection pairs) {
  std::unique_ptr<CollisionQuery>& query = queries_[representation][pairs];
  if (query == nullptr) query = std::make_unique<CollisionQuery>(dataset_->collision_model(representation, pairs));
  return *query;
}

SolveOutcome ProblemSolver::Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                                  const SolveSettings& settings) {
  return Solve(task, dataset_->problem(task, problem_id), initialization, method, settings);
}

SolveOutcome ProblemSolver::Solve(Task task, const ProblemDefinition& problem, Initialization initialization,
                                  const Method& method, const SolveSettings& settings) {
  return Run(*dataset_, Query(method.collision, method.pairs), task, initialization, method, settings, registry_)
      .Solve(problem);
}

}  // namespace legopt
