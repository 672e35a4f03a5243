#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/dataset.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/holding_probe.h"
#include "legopt/judge/internal/touch.h"
#include "legopt/judge/judge.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/check.h"

namespace legopt {

/// A value of a check, described for people.
struct CheckFinding {
  std::string subject;  ///< contact, joint, link or pair
  std::string detail;   ///< subject, value and tolerance
};

/// Adds a posture to a score.
void Count(const Holding& holding, HoldingScore* score);

/// Includes a value in the largest ones, one per check and rule. NaN counts as infinite. `subject` returns a string and
/// is called only for a new largest value above 0.
template <class Subject>
void IncludeViolation(Verdict check, Rule rule, int waypoint, double value, const Subject& subject,
                      std::vector<Violation>* violations) {
  if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  Violation* largest = nullptr;
  for (Violation& violation : *violations) {
    if (violation.check == check && violation.rule == rule) largest = &violation;
  }
  if (largest != nullptr && !(value > largest->value)) return;
  if (largest == nullptr) largest = &violations->emplace_back();
  *largest = {.check = check,
              .rule = rule,
              .waypoint = waypoint,
              .subject = value > 0 ? subject() : std::string(),
              .value = value};
}

// How the judge measures the checks of legopt/types/check.h at a waypoint.

/// Records values and failures of checks in an evaluation.
class CheckRecorder {
 public:
  /// `evaluation` must outlive this object. `first_waypoint`: number, in the whole motion, of the first judged
  /// waypoint.
  CheckRecorder(int first_waypoint, Evaluation* evaluation)
      : first_waypoint_(first_waypoint), evaluation_(evaluation) {}

  /// Sets the waypoint of the next values, numbered from the first judged one; -1: none.
  void set_waypoint(int waypoint) { waypoint_ = waypoint < 0 ? waypoint : first_waypoint_ + waypoint; }

  /// Records a value >= 0 that counts by `rule` and stricter ones. `describe` returns its CheckFinding.
  template <class Describe>
  void Measure(Verdict check, Rule rule, double value, bool failed, const Describe& describe) {
    IncludeViolation(
        check, rule, waypoint_, value, [&] { return describe().subject; }, &evaluation_->violations);
    if (failed) Fail(check, rule, describe().detail);
  }

  /// Counts a posture.
  void CountHolding(const Holding& holding) { Count(holding, &evaluation_->holding); }

  /// Records a failure by `rule` and stricter ones, unless they failed before. Its detail is kept unless a later
  /// waypoint fails by a more lenient rule.
  void Fail(Verdict check, Rule rule, const std::string& detail);

 private:
  int first_waypoint_;
  int waypoint_ = -1;
  Evaluation* evaluation_;
};

/// The checked waypoint, with workspaces of the judge.
struct CheckedWaypoint {
  const Dataset& dataset;
  const Stance& stance;
  const Eigen::VectorXd& x;      ///< raw: n + 7 finite numbers, quaternion of any norm but 0
  const Kinematics& kinematics;  ///< robot with joints clamped to their limits
  const Kinematics* previous;    ///< robot at the waypoint before; null at the first one
  ExactCollision& collision;
  TouchProbe& touch;
  HoldingProbe& holding;
};

/// How a check is measured.
struct WaypointCheck {
  Verdict check;
  void (*measure)(const CheckedWaypoint& waypoint, CheckRecorder& recorder);
};

/// Check of joint limits alone, for points between waypoints. Uses only the dataset and x.
void CheckLimits(const CheckedWaypoint& waypoint, CheckRecorder& recorder);
/// Checks of contacts, balance and joints (phase A), in the order of kChecks.
std::span<const WaypointCheck> PoseChecks();
/// Checks of bodies (phase B), in the order of kChecks. Made only if phase A passed at all waypoints.
std::span<const WaypointCheck> BodyChecks();

}  // namespace legopt
