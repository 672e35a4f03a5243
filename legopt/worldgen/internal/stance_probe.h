#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/terrain.h"
#include "legopt/robot/kinematics.h"
#include "legopt/worldgen/internal/reach_cloud.h"

namespace legopt::worldgen {

/// Criteria for valid contacts and stances. Lengths in metres.
struct ProbeOptions {
  double slope_rad = 0.45;    ///< maximum slope of the surface, (0, 1]
  double support_m = 3e-3;    ///< maximum distance between the ground and the plane of the contact patch
  double clearance_m = 6e-4;  ///< minimum distance of the foot's collision geometry at its target from the scene
  double reach_m = 0.70;      ///< maximum horizontal distance between the feet
  double step_m = 0.30;       ///< maximum height difference between the feet
  Eigen::Vector3d trunk_m = {0.40, 0.50, 0.70};  ///< size of the trunk box, x forward
  double trunk_low_m = 0.74;                     ///< height of the trunk box's lower side above the mean foot height
  Eigen::Vector2d trunk_centre_m = {0.0, 0.0};   ///< centre of the trunk box relative to the trunk; 0 for two feet

  /// Scales the defaults to another robot: all values except slope and tolerances are proportional to the height of the
  /// trunk above the contact patches (0.874 m for Atlas). For another number of feet than two, the trunk box contains
  /// the geometry that is fixed to the trunk, a tenth of the height lower than in the nominal posture, and the reach is
  /// 1.6 times the largest distance of two feet in that posture.
  static ProbeOptions For(const Dataset& dataset);
  /// Throws InputError: a value out of range, a reach at which the feet overlap or that exceeds the length of the legs,
  /// a dataset with fewer than two feet.
  void Validate(const Dataset& dataset) const;
};

/// Scene, feet and trunk for probes; shared by all threads.
struct ProbeModel {
  std::shared_ptr<const Dataset> dataset;
  ProbeOptions options;                             ///< validated
  Terrain terrain;                                  ///< all triangles of the scene
  RobotModel parts;                                 ///< a base without geometry, with the feet and the trunk box fixed
                                                    ///< to it
  std::shared_ptr<const CollisionModel> collision;  ///< collision model of `parts` and the scene
  std::shared_ptr<const ReachCloud> reach;          ///< reach of the legs; null for two feet

  /// Builds the model and validates the options. `seed`: seed of the reach cloud. Throws InputError, also if the scene
  /// has no surface flat enough to stand on, or if a leg cannot stand in any posture.
  static std::shared_ptr<const ProbeModel> Build(std::shared_ptr<const Dataset> dataset, const ProbeOptions& options,
                                                 std::uint64_t seed = 1);
  int trunk_link() const {
    return 1 + static_cast<int>(dataset->feet().size());
  }  ///< index of the trunk box in
     ///< `parts`
};

/// Checks contacts of feet and the distance between trunk and scene. Results depend on the arguments only. Not
/// thread-safe.
class StanceProbe {
 public:
  explicit StanceProbe(std::shared_ptr<const ProbeModel> model);

  const ProbeModel& model() const { return *model_; }

  /// Returns the contact of foot number `foot` at a point of the surface with the given normal: z axis along the
  /// normal, x axis in the vertical plane of the heading.
  ContactTarget Place(int foot, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double yaw_rad) const;
  /// Returns true if a contact is valid: slope, support of the whole contact patch, and a collision-free foot. A point
  /// contact needs no patch; only its ball is tested, with a radius of at least 5 mm.
  bool Holds(int foot, const ContactTarget& foothold);
  /// Finds all valid contacts above (x, y), highest first.
  void Footholds(int foot, double x, double y, double yaw_rad, std::vector<ContactTarget>& footholds);
  /// Returns the signed distance between the scene and the trunk box over the stance, at most `margin_m`.
  double TrunkDistance(const Stance& stance, double margin_m);
  /// Returns that distance for a trunk at `pose`.
  double TrunkDistance(const TrunkPose& pose, double margin_m);
  /// Returns the pose of the trunk over a stance: the best fit of the reach cloud, or over the middle of two feet.
  TrunkPose TrunkOver(const Stance& stance) const;

 private:
  double PartDistance(int link, const Eigen::Isometry3d& pose, double margin_m);
  bool Supported(int foot, const ContactTarget& foothold) const;

  std::shared_ptr<const ProbeModel> model_;
  Kinematics kinematics_;
  CollisionQuery query_;
  std::vector<Terrain::Hit> hits_;
};

/// Returns the heading of a contact about z.
double Yaw(const ContactTarget& foothold);

/// Returns the contacts of a stance by their indices in the dataset, with their positions.
std::vector<ReachCloud::Placement> PlacementsOf(const Dataset& dataset, const Stance& stance);

/// Throws InputError for the first mesh with holes or inverted winding, about which solver and judge would disagree.
void RequireClosedMeshes(const Dataset& dataset);

/// Throws InputError unless, of two feet, the first is on the left in the nominal posture, as planning assumes.
void RequireLeftFootFirst(const Dataset& dataset);

/// Throws InputError for a scene of more than 4 million squares of 20 cm in plan (400 m x 400 m): the size of the map
/// that guides plans (guide_map.h) is proportional to this area.
void RequireMappableScene(const Dataset& dataset);

/// Checks a source before generation starts: see ProbeOptions::Validate and RequireLeftFootFirst and, if its own scene
/// is used, RequireMappableScene and RequireClosedMeshes; the scene must also have ground to stand on. Throws
/// InputError with the user's files and flags.
void CheckSource(const std::shared_ptr<const Dataset>& source, const ProbeOptions& options, bool uses_scene);

}  // namespace legopt::worldgen
