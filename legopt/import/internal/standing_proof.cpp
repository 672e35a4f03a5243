#include "legopt/import/internal/standing_proof.h"

#include <algorithm>
#include <chrono>
#include <random>

#include "legopt/geometry/collision_query.h"
#include "legopt/import/internal/standing_stage.h"
#include "legopt/judge/judge.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/solvers/methods/method.h"

namespace legopt {
namespace {

/// Returns `x`, whose base is upright over the level ground, in a frame of the stage.
Eigen::VectorXd Moved(const Eigen::VectorXd& x, const Eigen::Isometry3d& X_WF) {
  Eigen::VectorXd moved = x;
  const auto parts = MutablePartsOf(moved);
  parts.base_position() = X_WF * Eigen::Vector3d(PartsOf(x).base_position());
  parts.set_base_quaternion(Eigen::Quaterniond(X_WF.linear()) * PartsOf(x).base_rotation());
  return moved;
}

/// Returns true if a posture satisfies the terms with these names, and the joint limits.
bool HasSolution(const Dataset& stage, const Stance& stance, const std::vector<std::string>& names,
                 const Eigen::VectorXd& start) {
  if (names.empty()) return true;
  CollisionQuery query(stage.collision_model(SceneRepresentation::kSolid, PairSelection::kAll));
  const WaypointConstraints constraints{.stance = &stance};
  WaypointProgram program(stage, query, {&constraints, 1}, {});
  program.Keep([&](const Term& term) { return std::ranges::find(names, term.shape().name) != names.end(); });
  Eigen::VectorXd x = start;
  std::mt19937_64 generator(1);
  return MakeSolver(Method::Of("best"))->Solve(program, x, {.stop = {}, .generator = &generator}).feasible;
}

/// Returns a smallest set of terms without a solution, by leaving out one term after the other; empty if all of them
/// have one.
std::vector<std::string> FindConflict(const Dataset& stage, const Stance& stance, const Eigen::VectorXd& start) {
  std::vector<std::string> names;
  for (const ContactTarget& target : stance.contacts) names.push_back("foot " + target.contact);
  names.emplace_back("centre of mass");
  names.emplace_back("collision");
  if (HasSolution(stage, stance, names, start)) return {};
  for (std::size_t i = 0; i < names.size();) {
    std::vector<std::string> fewer = names;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (HasSolution(stage, stance, fewer, start)) {
      ++i;
    } else {
      names = std::move(fewer);
    }
  }
  return names;
}

}  // namespace

StandingProof ProveStanding(const std::shared_ptr<const Dataset>& stage, const Eigen::VectorXd& nominal, bool on_ramp) {
  const Eigen::Isometry3d X_WF = StandingFrame(on_ramp);
  const Stance stance = StanceBelow(*stage, nominal, X_WF);
  StandingProof proof;
  proof.x = Moved(nominal, X_WF);
  CollisionQuery query(stage->collision_model(SceneRepresentation::kSolid, PairSelection::kAll));
  const auto program = MakeTaskProgram(Task::kPosture, *stage, query, {&stance, 1}, {});
  std::mt19937_64 generator(1);
  const auto begin = std::chrono::steady_clock::now();
  MakeSolver(Method::Of("best"))->Solve(*program, proof.x, {.stop = {}, .generator = &generator});
  proof.solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Judge judge(stage);
  const ProblemDefinition problem{.id = 0, .stances = {stance}};
  const Evaluation evaluation = judge.Evaluate(Task::kPosture, problem, {&proof.x, 1});
  proof.stands = evaluation.solid == Verdict::kSuccess;
  const Eigen::Vector3d com = [&] {
    Kinematics kinematics(stage->robot());
    kinematics.Update(proof.x);
    return kinematics.com();
  }();
  proof.com_margin_m = -SignedDistanceToPolygon(TargetSupportPolygon(*stage, stance), com.head<2>());
  if (proof.stands) return proof;
  proof.detail = evaluation.detail;
  proof.conflict = FindConflict(*stage, stance, Moved(nominal, X_WF));
  return proof;
}

}  // namespace legopt
