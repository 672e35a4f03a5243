#include "legopt/import/internal/balance_check.h"

#include <cmath>
#include <map>
#include <string>

#include "legopt/import/internal/used_contacts.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {
namespace {

/// Stances of problems.
struct Stances {
  int count = 0;
  std::string first;  ///< e.g. "posture 3, stance 0"
  ProblemIds problems;

  void Add(Task task, int id, std::size_t stance) {
    if (count++ == 0) {
      first = std::string(ToString(task)) + " " + std::to_string(id) + ", stance " + std::to_string(stance);
    }
    problems[task].insert(id);
  }
};

/// Returns true if an effort limit bounds the forces of a contact that carries.
bool LimitsForces(const Dataset& dataset, const Stance& stance) {
  const RobotModel& robot = dataset.robot();
  for (const ContactTarget& target : stance.contacts) {
    if (!target.carries) continue;
    for (const int body : robot.body_chain(robot.link_body(dataset.contact(target.contact).link_index))) {
      const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.body_joint(body))];
      if (std::isfinite(robot.effort_limits()[joint.dof])) return true;
    }
  }
  return false;
}

/// Returns true if every posture of an unbounded stance counts as held, by every rule.
bool HoldsEverything(const Dataset& dataset, const Stance& stance) {
  return !StandsOnFeet(dataset, stance) && !LimitsForces(dataset, stance);
}

DatasetDiagnostic Diagnose(const Stances& stances, int all, bool holds_everything) {
  return {
      .severity = holds_everything ? DatasetDiagnostic::Severity::kError : DatasetDiagnostic::Severity::kWarning,
      .check = "balance",
      .file = kDatasetFileName,
      .field = ToString(stances.problems),
      .value = std::to_string(stances.count) + " of " + std::to_string(all) + " stances, first " + stances.first,
      .message =
          "hold the centre of mass anywhere: the polygon of its positions is unbounded, because contacts "
          "press against each other without a bound" +
          std::string(holds_everything ? "; no joint between them has an effort limit, so every posture counts as held"
                                       : "; balance demands nothing there"),
      .fix = std::string("give these contacts max_normal_N") +
             (holds_everything ? ", or their joints effort_limits" : ", if balance should decide")};
}

}  // namespace

std::vector<DatasetDiagnostic> CheckBalance(const Dataset& dataset) {
  Stances held, warned;
  int all = 0;
  std::map<std::string, bool> known;  // key: StanceKey
  for (const TaskDescription& task : ProblemTasks()) {
    for (const ProblemDefinition& problem : dataset.problems(task.task)) {
      for (std::size_t s = 0; s < problem.stances.size(); ++s, ++all) {
        const Stance& stance = problem.stances[s];
        const auto [found, is_new] = known.try_emplace(StanceKey(stance), false);
        if (is_new) found->second = IsUnbounded(StanceForces(SurfacesOf(dataset, stance)));
        if (found->second) (HoldsEverything(dataset, stance) ? held : warned).Add(task.task, problem.id, s);
      }
    }
  }
  std::vector<DatasetDiagnostic> findings;
  if (held.count > 0) findings.push_back(Diagnose(held, all, true));
  if (warned.count > 0) findings.push_back(Diagnose(warned, all, false));
  return findings;
}

}  // namespace legopt
