#include "legopt/worldgen/source_check.h"

#include <string>

#include "legopt/geometry/mesh.h"
#include "legopt/geometry/mesh_faults.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/classic_stream.h"
#include "legopt/types/input_error.h"

namespace legopt::worldgen {

void RequireClosedMeshes(const Dataset& dataset) {
  for (const SceneObject& object : dataset.scene().objects) {
    if (object.shape.kind != ShapeSpec::Kind::kMesh) continue;
    const MeshFaults faults = FindMeshFaults(Tessellate(object.shape, dataset.scene().read_guard));
    if (faults.none()) continue;
    const bool holes = faults.open_edges > 0;
    throw InputError({object.shape.mesh_file, "scene object '" + object.name + "'",
                      holes ? std::to_string(faults.open_edges) + " open edges"
                            : std::to_string(faults.inverted_components) + " bodies",
                      holes ? "the mesh has holes" : "the mesh is wound inside out",
                      holes ? "close it" : "turn the triangles of these bodies round"});
  }
}

void RequireMappableScene(const Dataset& dataset) {
  constexpr double kCell_m = 0.2, kMaxCells = 4e6;
  const Eigen::Vector3d size = dataset.scene_bounds().sizes();
  if (size.x() * size.y() <= kMaxCells * kCell_m * kCell_m) return;
  ClassicOutput text;
  text << size.x() << " m x " << size.y() << " m";
  throw InputError({(dataset.folder() / kDatasetFileName).string(), "scene", text.str(),
                    "is too wide for the map that guides footstep plans, which has at most 4 million squares of 20 cm",
                    "is it in millimetres? Scale it to metres (scale: 0.001), or cut out a part"});
}

void RequireLeftFootFirst(const Dataset& dataset) {
  if (dataset.contacts().size() != 2) return;
  constexpr double kSide_m = 1e-3;  // feet placed one behind the other have no lateral order
  const Contact& first = dataset.contacts().at(0);
  const Contact& second = dataset.contacts().at(1);
  Eigen::VectorXd posture = dataset.self_collision_reference();  // its base is at the origin
  posture.head(dataset.nominal_joints().size()) = dataset.nominal_joints();
  Kinematics kinematics(dataset.robot());
  kinematics.Update(posture);
  const double to_the_left_m = kinematics.link_pose(first.link_index).translation().y() -
                               kinematics.link_pose(second.link_index).translation().y();
  if (to_the_left_m > -kSide_m) return;
  throw InputError(
      {(dataset.folder() / kDatasetFileName).string(), "feet", first.link + ", " + second.link,
       "the first foot stands to the right of the second in the nominal posture, and every plan would "
       "cross the legs",
       "name the left foot first: feet: [" + second.link + ", " + first.link + "], then run 'legopt dataset hash'"});
}

void CheckSource(const std::shared_ptr<const Dataset>& source, const ProbeOptions& options, bool uses_scene) {
  options.Validate(*source);
  RequireLeftFootFirst(*source);
  if (!uses_scene) return;
  RequireMappableScene(*source);
  RequireClosedMeshes(*source);
  ProbeModel::Build(source, options);
}

}  // namespace legopt::worldgen
