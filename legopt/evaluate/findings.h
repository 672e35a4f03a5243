#pragma once

#include <Eigen/Dense>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/collision/exact_collision.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/robot/kinematics.h"
#include "words/result.h"

namespace legopt {

/// A foot beside its target.
struct FootFinding {
  std::string link;       ///< its name
  double violation = 0;   ///< largest component of the error, as of ErrorOfFootPose: quaternion (1), translation (m)
  int component = 0;      ///< which one: 0..2 quaternion x y z, 3..5 translation x y z, in the target frame
  bool violated = false;  ///< above kPoseTolerance
};

/// A joint at its limit or beyond it.
struct LimitFinding {
  int dof = 0;            ///< degree of freedom
  double value = 0;       ///< of the raw vector, rad (m for prismatic)
  double limit = 0;       ///< that it is at, rad (m)
  double excess = 0;      ///< beyond the limit, rad (m); negative: so far inside
  bool violated = false;  ///< beyond it by more than kLimitTolerance
};

/// Two things in each other.
struct OverlapFinding {
  ExactCollision::Overlap overlap;  ///< which, how deep and where
  std::optional<Rule> fails;        ///< the most lenient rule by which it is a collision; none: tolerated
};

/// All that the judge looks at in one configuration, as figures. See Judge for the rules.
struct WaypointFindings {
  std::vector<FootFinding> feet;                             ///< of the stance, in its order
  Eigen::Vector3d com_W = Eigen::Vector3d::Zero();           ///< centre of mass, m
  std::vector<Eigen::Vector2d> polygon_W;                    ///< support polygon, world xy, counter-clockwise, m
  double com_m = 0;                                          ///< its signed distance: > 0 outside
  bool com_violated = false;                                 ///< above kComTolerance_m
  std::vector<LimitFinding> limits;                          ///< joints within kNearLimit of a limit or beyond it
  std::vector<OverlapFinding> overlaps;                      ///< all, tolerated ones, too
  double step_m = std::numeric_limits<double>::quiet_NaN();  ///< from the waypoint before; NaN: none was given
  int step_link = -1;                                        ///< that moved so far
};

/// How near a limit a joint is listed, rad or m.
inline constexpr double kNearLimit = 1e-3;

/// Lists what the judge finds at single configurations, by the same kinematics, meshes and tolerances, for people who
/// want to see it. It decides nothing: verdicts are the Judge's, whose figures are the largest of these.
///
/// Holds workspaces: one thread at a time; the dataset is shared. Construction builds the dataset's collision model if
/// nobody has yet, and throws InputError when a mesh is corrupt.
class FindingLister {
 public:
  /// `dataset`: shared with the lister. See above for what this costs and throws.
  explicit FindingLister(std::shared_ptr<const Dataset> dataset);

  /// Of the configuration `x` (n + 7 finite numbers, the quaternion of any norm above 0; else nothing is listed) under
  /// a stance, whose links must be feet of the dataset (InputError). `before`: the waypoint before it, or null.
  WaypointFindings At(const Stance& stance, const Eigen::VectorXd& x, const Eigen::VectorXd* before = nullptr);

  /// Only what is in each other on the way from one waypoint to the next, at `s` in [0, 1] of InterpolateConfiguration.
  std::vector<OverlapFinding> Between(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double s);

  const Dataset& dataset() const { return *dataset_; }  ///< as given at construction

 private:
  bool SetState(const Eigen::VectorXd& x, Kinematics* kinematics) const;
  void ListFeet(const Stance& stance, WaypointFindings* findings) const;
  void ListLimits(const Eigen::VectorXd& x, WaypointFindings* findings) const;

  std::shared_ptr<const Dataset> dataset_;
  Kinematics kinematics_;
  Kinematics previous_;  ///< of the waypoint before
  ExactCollision collision_;
};

}  // namespace legopt
