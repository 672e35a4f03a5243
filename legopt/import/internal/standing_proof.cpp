#include "legopt/import/internal/standing_proof.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>
#include <string>

#include "legopt/geometry/collision_query.h"
#include "legopt/import/internal/nominal_posture.h"
#include "legopt/import/internal/standing_stage.h"
#include "legopt/judge/judge.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/types/check.h"

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

const std::string kNotTouching =
    "the centre of mass is not above what touches the ground: the description of the contacts does not fit the robot. ";

/// Returns the start of an attempt: `x`, or with random joints near it for later ones.
Eigen::VectorXd StartOf(int attempt, const RobotModel& robot, const Eigen::VectorXd& x) {
  constexpr double kNoise_rad = 0.3;
  Eigen::VectorXd start = x;
  std::mt19937_64 generator(static_cast<std::uint64_t>(attempt));
  if (attempt > 0) PerturbJoints(robot, generator, kNoise_rad, start);
  return start;
}

/// Returns true if a posture is found that satisfies the terms with these names, and the joint limits.
bool HasSolution(const Dataset& stage, const Stance& stance, const std::vector<std::string>& names,
                 const Eigen::VectorXd& start) {
  constexpr int kAttempts = 3;
  if (names.empty()) return true;
  CollisionQuery query(stage.collision_model(SceneRepresentation::kSolid, PairSelection::kAll));
  const WaypointConstraints constraints{.stance = &stance};
  WaypointProgram program(stage, query, {&constraints, 1}, {});
  program.Keep([&](const Term& term) { return std::ranges::find(names, term.shape().name) != names.end(); });
  const std::unique_ptr<Solver> solver = MakeSolver(Method::Of("best"));
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Eigen::VectorXd x = StartOf(attempt, stage.robot(), start);
    std::mt19937_64 generator(1);
    if (solver->Solve(program, x, {.stop = {}, .generator = &generator}).feasible) return true;
  }
  return false;
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
  // The judge's meshes are finer than the solver's shapes, so that it may reject postures that the solver found.
  constexpr int kAttempts = 40, kUnsolvedAttempts = 8;
  const int attempts = stage->robot().num_dofs() > kManyDofs ? 1 : kAttempts;
  const Eigen::Isometry3d X_WF = StandingFrame(on_ramp);
  const Stance stance = StanceBelow(*stage, nominal, X_WF);
  const Eigen::VectorXd moved = Moved(nominal, X_WF);
  CollisionQuery query(stage->collision_model(SceneRepresentation::kSolid, PairSelection::kAll));
  const auto program = MakeTaskProgram(Task::kPosture, *stage, query, {&stance, 1}, {});
  const std::unique_ptr<Solver> solver = MakeSolver(Method::Of("best"));
  Judge judge(stage);
  const ProblemDefinition problem{.id = 0, .stances = {stance}};
  StandingProof proof;
  int unsolved = 0;
  for (int attempt = 0; attempt < attempts && unsolved < kUnsolvedAttempts && !proof.stands; ++attempt) {
    Eigen::VectorXd x = StartOf(attempt, stage->robot(), moved);
    std::mt19937_64 generator(1);
    const auto begin = std::chrono::steady_clock::now();
    const SolverResult result =
        solver->Solve(*program, x, {.stop = StopOfLarge(stage->robot()), .generator = &generator});
    unsolved += result.feasible ? 0 : 1;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    const Evaluation evaluation = judge.Evaluate(Task::kPosture, problem, {&x, 1});
    // Contacts without declared points never fail to touch by the rule.
    const bool solid = evaluation.solid == Verdict::kSuccess;
    proof.stands = solid && !(evaluation.Largest(Verdict::kCom, Rule::kSolid) > kComTolerance_m);
    if (attempt > 0 && !proof.stands) continue;  // the failure from the nominal posture is the one that is reported
    proof.x = x;
    proof.solve_s = elapsed.count();
    proof.detail = proof.stands ? "" : solid ? kNotTouching + evaluation.detail : evaluation.detail;
  }
  Kinematics kinematics(stage->robot());
  kinematics.Update(proof.x);
  const Eigen::Vector3d com = kinematics.com();
  proof.com_margin_m = -SignedDistanceToPolygon(TargetSupportPolygon(*stage, stance), com.head<2>());
  const bool explained = proof.stands || proof.detail.starts_with(kNotTouching);
  if (!explained && stage->robot().num_dofs() <= kManyDofs) proof.conflict = FindConflict(*stage, stance, moved);
  return proof;
}

}  // namespace legopt
