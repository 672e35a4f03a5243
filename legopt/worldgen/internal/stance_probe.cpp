#include "legopt/worldgen/internal/stance_probe.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::worldgen {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

void Check(bool good, const char* field, double value, const std::string& message, const std::string& fix) {
  if (!good) throw InputError({"", field, FormatFixed(value, 6), message, fix});
}

RobotModel MakeParts(const Dataset& dataset, const ProbeOptions& options) {
  std::vector<Link> links(1);
  links[0].name = "probe";
  for (const Contact& foot : dataset.contacts()) {
    Link link;
    link.name = foot.link;
    link.collision = dataset.robot().links()[static_cast<size_t>(foot.link_index)].collision;
    links.push_back(std::move(link));
  }
  Link trunk;
  trunk.name = "trunk";
  trunk.collision.resize(1);
  trunk.collision[0].kind = ShapeSpec::Kind::kBox;
  trunk.collision[0].size = options.trunk_m;
  links.push_back(std::move(trunk));
  std::vector<Joint> joints;
  for (size_t k = 1; k < links.size(); ++k) {
    Joint joint;
    joint.name = "fixed-" + std::to_string(k);
    joint.parent_link = 0;
    joint.child_link = static_cast<int>(k);
    links[k].parent_joint = static_cast<int>(joints.size());
    joints.push_back(std::move(joint));
  }
  return {"probe", std::move(links), std::move(joints)};
}

}  // namespace

ProbeOptions ProbeOptions::For(const Dataset& dataset) {
  constexpr double kAtlasHeight_m = 0.873903;
  ProbeOptions options;
  const double scale = -dataset.nominal_sole_height_m() / kAtlasHeight_m;
  options.reach_m *= scale;
  options.step_m *= scale;
  options.trunk_m *= scale;
  options.trunk_low_m *= scale;
  return options;
}

void ProbeOptions::Validate(const Dataset& dataset) const {
  if (dataset.contacts().size() != 2) {
    throw InputError(
        {(dataset.folder() / kDatasetFileName).string(), "feet", std::to_string(dataset.contacts().size()) + " feet",
         "stances are sampled for robots with two feet", "name the left and the right foot, in this order"});
  }
  Check(slope_rad > 0.0 && slope_rad <= 1.0, "--slope", slope_rad, "must lie in (0, 1] rad", "the default is 0.45");
  Check(support_m > 0.0, "support", support_m, "must be positive", "the default is 0.003 m");
  Check(trunk_m.minCoeff() > 0.0, "trunk", trunk_m.minCoeff(), "must have positive sides", "leave it out");
  Check(step_m > 0.0, "step", step_m, "must be positive", "leave it out");
  const double width =
      std::min(dataset.contacts()[0].Patch().sizes().minCoeff(), dataset.contacts()[1].Patch().sizes().minCoeff());
  Check(std::isfinite(reach_m), "--radius", reach_m, "must be a finite length", "leave it out");
  Check(reach_m > 1.2 * width, "--radius", reach_m,
        "is so small that the feet overlap (a foot is " + std::to_string(width) + " m wide)",
        "leave it out, or use a larger one");
  const double leg = -dataset.nominal_sole_height_m();
  Check(reach_m < 1.3 * leg, "--radius", reach_m,
        "exceeds the robot's reach (the base is " + std::to_string(leg) + " m above the soles)",
        "leave it out, or use a smaller one");
}

std::shared_ptr<const ProbeModel> ProbeModel::Build(std::shared_ptr<const Dataset> dataset,
                                                    const ProbeOptions& options) {
  options.Validate(*dataset);
  RobotModel parts = MakeParts(*dataset, options);
  Eigen::VectorXd reference = ConfigurationAt(0, Isometry3d::Identity());
  auto collision = CollisionModel::Build(parts, dataset->scene(), reference);
  Terrain terrain(CollectSceneTriangles(dataset->scene()));
  const double least_nz = std::cos(options.slope_rad);
  bool found = false;
  for (size_t t = 0; t < terrain.mesh().triangles.size() && !found; ++t) {
    found = terrain.normal(static_cast<int>(t)).z() >= least_nz;
  }
  if (!found) {
    throw InputError({(dataset->folder() / kDatasetFileName).string(), "scene", "",
                      "the scene has no walkable ground: no surface "
                      "looks up within " +
                          std::to_string(options.slope_rad) + " rad of the vertical",
                      "check that z is up and that the triangles are wound outwards"});
  }
  return std::make_shared<const ProbeModel>(
      ProbeModel{std::move(dataset), options, std::move(terrain), std::move(parts), std::move(collision)});
}

StanceProbe::StanceProbe(std::shared_ptr<const ProbeModel> model)
    : model_(std::move(model)), kinematics_(model_->parts), query_(model_->collision) {}

double Yaw(const ContactTarget& foothold) {
  const Vector3d forward = foothold.rotation * Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

ContactTarget StanceProbe::Place(int foot, const Vector3d& point, const Vector3d& normal, double yaw_rad) const {
  const Vector3d heading(std::cos(yaw_rad), std::sin(yaw_rad), 0.0);
  // The foot's x axis lies in the surface, in the vertical plane of the heading.
  const Vector3d left = normal.cross(heading).normalized();
  Eigen::Matrix3d rotation;
  rotation << left.cross(normal), left, normal;
  return {.contact = model_->dataset->contacts()[static_cast<size_t>(foot)].name,
          .position = point,
          .rotation = Eigen::Quaterniond(rotation).normalized()};
}

double StanceProbe::PartDistance(int link, const Isometry3d& pose, double margin_m) {
  kinematics_.Update(ConfigurationAt(0, pose));
  double nearest = margin_m;
  for (const ProximityPair& contact : query_.SceneContacts(kinematics_, margin_m, std::span(&link, 1))) {
    nearest = std::min(nearest, contact.distance_m);
  }
  return nearest;
}

/// Samples the rectangle of the contact patch, including its edges, at most 4 cm apart.
bool StanceProbe::Supported(int foot, const ContactTarget& foothold) const {
  constexpr double kSpacing_m = 0.04;
  constexpr double kInset_m = 0.002;  // a contact patch may end at the edge of its slab
  const Eigen::AlignedBox2d patch = model_->dataset->contacts()[static_cast<size_t>(foot)].Patch();
  const Eigen::Matrix3d rotation = foothold.rotation.toRotationMatrix();
  const int nx = 1 + static_cast<int>(std::ceil(patch.sizes().x() / kSpacing_m));
  const int ny = 1 + static_cast<int>(std::ceil(patch.sizes().y() / kSpacing_m));
  const auto at = [&](double low, double high, int k, int n) {
    return low + kInset_m + (high - low - 2.0 * kInset_m) * k / (n - 1);
  };
  const double tolerance = model_->options.support_m;
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      const Vector3d p = foothold.position + rotation * Vector3d(at(patch.min().x(), patch.max().x(), i, nx),
                                                                 at(patch.min().y(), patch.max().y(), j, ny), 0.0);
      if (model_->terrain.Highest(p.x(), p.y(), p.z() - tolerance, p.z() + tolerance).triangle < 0) return false;
    }
  }
  return true;
}

bool StanceProbe::Holds(int foot, const ContactTarget& foothold) {
  const Vector3d normal = foothold.rotation * Vector3d::UnitZ();
  if (normal.z() < std::cos(model_->options.slope_rad) || !Supported(foot, foothold)) return false;
  const double clearance = model_->options.clearance_m;
  return PartDistance(1 + foot, model_->dataset->LinkTarget(foothold), clearance) >= clearance;
}

void StanceProbe::Footholds(int foot, double x, double y, double yaw_rad, std::vector<ContactTarget>& footholds) {
  footholds.clear();
  const Terrain& terrain = model_->terrain;
  terrain.Ground(x, y, terrain.bounds().min().z(), terrain.bounds().max().z(), hits_);
  for (const Terrain::Hit& hit : hits_) {
    ContactTarget foothold = Place(foot, {x, y, hit.z_m}, terrain.normal(hit.triangle), yaw_rad);
    if (Holds(foot, foothold)) footholds.push_back(std::move(foothold));
  }
}

double StanceProbe::TrunkDistance(const Stance& stance, double margin_m) {
  Vector3d centre = Vector3d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  for (const ContactTarget& foothold : stance.contacts) {
    centre += foothold.position / static_cast<double>(stance.contacts.size());
    const double yaw = Yaw(foothold);
    heading += Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
  }
  const ProbeOptions& options = model_->options;
  centre.z() += options.trunk_low_m + 0.5 * options.trunk_m.z();
  const Isometry3d pose =
      Eigen::Translation3d(centre) * Eigen::AngleAxisd(std::atan2(heading.y(), heading.x()), Vector3d::UnitZ());
  return PartDistance(model_->trunk_link(), pose, margin_m);
}

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
