#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/collision/terrain.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/robot/kinematics.h"

namespace legopt::generate {

/// What counts as a place to stand. Lengths in metres.
struct ProbeOptions {
  double slope_rad = 0.45;    ///< steepest surface, (0, 1]
  double support_m = 3e-3;    ///< the ground below any point of the sole is at most this far from the sole's plane
  double clearance_m = 6e-4;  ///< least distance of the foot, standing at its sole offset, from everything
  double reach_m = 0.70;      ///< largest horizontal distance between the feet
  double step_m = 0.30;       ///< largest height difference between the feet
  Eigen::Vector3d trunk_m = {0.40, 0.50, 0.70};  ///< box that stands for the trunk, x forward
  double trunk_low_m = 0.74;                     ///< its lowest side above the mean foot height

  /// The same proportions for another robot: everything but the slope and the tolerances grows with the height of the
  /// base above the soles (0.874 m for Atlas).
  static ProbeOptions For(const Dataset& dataset);
  /// Throws InputError: a value out of range, a reach with which the feet would overlap or that is longer than the legs
  /// are, a dataset with fewer than two feet.
  void Validate(const Dataset& dataset) const;
};

/// Scene, feet and trunk as the probes see them; shared by all threads.
struct ProbeModel {
  std::shared_ptr<const Dataset> dataset;           ///< scene, feet and robot
  ProbeOptions options;                             ///< validated
  Terrain terrain;                                  ///< all triangles of the scene
  RobotModel parts;                                 ///< an empty base with the feet and the trunk box fixed to it
  std::shared_ptr<const CollisionModel> collision;  ///< of `parts` and the scene

  /// Validates the options. Throws InputError, also when the scene has no surface flat enough to stand on.
  static std::shared_ptr<const ProbeModel> Build(std::shared_ptr<const Dataset> dataset, const ProbeOptions& options);
  int trunk_link() const { return 1 + static_cast<int>(dataset->feet().size()); }  ///< the trunk box in `parts`
};

/// Asks where a foot can stand and how near the trunk is to the scene. One thread; pure functions of their arguments.
class StanceProbe {
 public:
  /// `model` is shared; the probe keeps it alive.
  explicit StanceProbe(std::shared_ptr<const ProbeModel> model);

  const ProbeModel& model() const { return *model_; }  ///< as given at construction

  /// Foothold of foot number `foot` on the surface at (x, y, z) with the given normal: z axis along the normal, x axis
  /// in the vertical plane of the heading.
  Foothold Place(int foot, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double yaw_rad) const;
  /// Slope, support of the whole sole, and a foot that touches nothing.
  bool Holds(int foot, const Foothold& foothold);
  /// All footholds above (x, y) that hold, highest first.
  void Footholds(int foot, double x, double y, double yaw_rad, std::vector<Foothold>& footholds);
  /// Signed distance of the trunk box over the stance from the scene, at most `margin_m`.
  double TrunkDistance(const Stance& stance, double margin_m);

 private:
  double PartDistance(int link, const Eigen::Isometry3d& pose, double margin_m);
  bool Supported(int foot, const Foothold& foothold) const;

  std::shared_ptr<const ProbeModel> model_;
  Kinematics kinematics_;
  CollisionQuery query_;
  std::vector<Terrain::Hit> hits_;
};

/// Heading of a foothold about z.
double Yaw(const Foothold& foothold);

}  // namespace legopt::generate
