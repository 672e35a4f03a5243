#pragma once

#include <Eigen/Dense>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/holding_diagnostic.h"
#include "legopt/judge/internal/holding_probe.h"
#include "legopt/judge/internal/touch.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/check.h"

namespace legopt {

/// Pose error of a foot.
struct FootDiagnostic {
  std::string link;
  double violation = 0;   ///< largest component of ComputeContactPoseError: quaternion (1), translation (m)
  int component = 0;      ///< index of that component: 0..2 quaternion x y z, 3..5 translation x y z, in the target
                          ///< frame
  bool violated = false;  ///< above kPoseTolerance
};

/// A joint near or beyond its limit.
struct LimitDiagnostic {
  int dof = 0;
  double value = 0;       ///< raw value, rad (m for prismatic)
  double limit = 0;       ///< nearest limit, rad (m)
  double excess = 0;      ///< distance beyond the limit, rad (m); negative: inside
  bool violated = false;  ///< excess above kLimitTolerance
};

/// A collision or tolerated overlap.
struct OverlapDiagnostic {
  ExactCollision::Overlap overlap;  ///< pair, depth and position
  std::optional<Rule> fails;        ///< most lenient rule that counts it as a collision; none: tolerated
};

/// Value of a check at one waypoint.
struct CheckDiagnostic {
  Violation value;
  bool violated = false;  ///< above the tolerance
};

/// All numbers that the judge checks for one configuration. The rules are those of Judge.
struct WaypointDiagnostics {
  std::vector<FootDiagnostic> feet;                 ///< ordered as in the stance
  Eigen::Vector3d com_W = Eigen::Vector3d::Zero();  ///< centre of mass, m
  std::vector<Eigen::Vector2d> polygon_W;           ///< support polygon, or equilibrium polygon where hands
                                                    ///< carry, world xy, counter-clockwise, m
  double com_m = 0;                                 ///< signed distance of the centre of mass from the
                                                    ///< polygon: > 0 outside
  bool com_violated = false;                        ///< above kComTolerance_m
  std::vector<LimitDiagnostic> limits;              ///< joints within kNearLimit of a limit or beyond it
  std::vector<OverlapDiagnostic> overlaps;          ///< including tolerated ones
  std::vector<CheckDiagnostic> values;              ///< checks that have no list of their own above
  bool on_feet = true;        ///< StandsOnFeet: polygon_W is the support polygon, not the equilibrium polygon
  HoldingDiagnostic holding;  ///< forces and torques, or why there are none
};

/// Distance from a limit, rad or m, below which a joint is listed.
inline constexpr double kNearLimit = 1e-3;

/// Lists the judge's findings at single configurations for inspection, with the same kinematics, meshes and tolerances.
/// Verdicts are the Judge's alone; its figures are the maxima of these.
///
/// Contains workspaces: not thread-safe; the dataset is shared. The constructor builds the dataset's collision model if
/// necessary, and throws InputError for a corrupt mesh.
class WaypointInspector {
 public:
  explicit WaypointInspector(std::shared_ptr<const Dataset> dataset);
  WaypointInspector(const WaypointInspector&) = delete;
  WaypointInspector& operator=(const WaypointInspector&) = delete;

  /// Lists the findings for the configuration `x` under a stance, whose links must be feet of the dataset (else
  /// InputError). `x`: n + 7 finite numbers with a non-zero quaternion of any norm; otherwise the lists are empty.
  /// `before`: the previous waypoint, or null.
  WaypointDiagnostics At(const Stance& stance, const Eigen::VectorXd& x, const Eigen::VectorXd* before = nullptr);

  /// Lists only the overlaps at `s` in [0, 1] of InterpolateConfiguration between two waypoints.
  std::vector<OverlapDiagnostic> TransitionRule(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double s);

  const Dataset& dataset() const { return *dataset_; }

 private:
  bool SetState(const Eigen::VectorXd& x, Kinematics* kinematics) const;
  void ListFeet(const Stance& stance, WaypointDiagnostics* findings);
  void ListLimits(const Eigen::VectorXd& x, WaypointDiagnostics* findings) const;
  void ListValues(const Stance& stance, const Eigen::VectorXd& x, bool has_previous, WaypointDiagnostics* findings);

  std::shared_ptr<const Dataset> dataset_;
  Kinematics kinematics_;
  Kinematics previous_;  ///< state at the previous waypoint
  ExactCollision collision_;
  TouchProbe touch_;
  HoldingProbe holding_;
};

}  // namespace legopt
