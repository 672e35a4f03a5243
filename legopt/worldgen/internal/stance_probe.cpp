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

/// Returns the radius of the ball with which a point contact is tested, m.
double BallRadius_m(const Contact& contact) {
  constexpr double kLeast_m = 5e-3;
  return std::max(kLeast_m, contact.radius_m);
}

const Link& LinkOf(const Dataset& dataset, const Contact& contact) {
  return dataset.robot().links()[static_cast<size_t>(contact.link_index)];
}

RobotModel MakeParts(const Dataset& dataset, const ProbeOptions& options) {
  std::vector<Link> links(1);
  links[0].name = "probe";
  for (const Contact& foot : dataset.feet()) {
    Link link;
    link.name = foot.link;
    link.collision = LinkOf(dataset, foot).collision;
    if (foot.facts().shape == ContactShape::kBall) {
      link.collision.assign(1, {});
      link.collision[0].kind = ShapeSpec::Kind::kSphere;
      link.collision[0].size.x() = BallRadius_m(foot);
    }
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

/// Returns the configuration of the nominal posture with the base at the origin.
Eigen::VectorXd NominalConfiguration(const Dataset& dataset) {
  Eigen::VectorXd posture = dataset.self_collision_reference();  // its base is at the origin
  posture.head(dataset.nominal_joints().size()) = dataset.nominal_joints();
  return posture;
}

/// Returns the largest horizontal distance of two contacts in the nominal posture, m.
double NominalSpan_m(const Dataset& dataset) {
  Kinematics kinematics(dataset.robot());
  kinematics.Update(NominalConfiguration(dataset));
  double span_m = 0.0;
  const auto place = [&](const Contact& contact) {
    return (kinematics.link_pose(contact.link_index) * contact.X_LC).translation().head<2>().eval();
  };
  for (const Contact& a : dataset.feet()) {
    for (const Contact& b : dataset.feet()) span_m = std::max(span_m, (place(a) - place(b)).norm());
  }
  return span_m;
}

/// Returns the box of the geometry that is fixed to the trunk, in the trunk's frame; empty if there is none.
Eigen::AlignedBox3d TrunkBox(const Dataset& dataset) {
  const RobotModel& robot = dataset.robot();
  const Trunk& trunk = dataset.trunk();
  const Isometry3d X_TB = (robot.link_in_body(trunk.link) * trunk.X_LT).inverse(Eigen::Isometry);
  Eigen::AlignedBox3d box;
  for (size_t k = 0; k < robot.links().size(); ++k) {
    const int link = static_cast<int>(k);
    if (robot.link_body(link) != robot.link_body(trunk.link) || robot.links()[k].collision.empty()) continue;
    box.extend(LinkBox(robot.links()[k], robot.read_guard()).transformed(X_TB * robot.link_in_body(link)));
  }
  return box;
}

/// Sets trunk box and reach of a robot with another number of feet than two.
void FitToLegs(const Dataset& dataset, ProbeOptions& options) {
  constexpr double kReach = 1.6;
  constexpr double kLowered = 0.1;
  constexpr double kLeastClearance = 0.05;
  const double height_m = dataset.trunk_height_m();
  options.reach_m = kReach * NominalSpan_m(dataset);
  const Eigen::AlignedBox3d box = TrunkBox(dataset);
  if (box.isEmpty()) return;
  options.trunk_m = box.sizes();
  options.trunk_centre_m = box.center().head<2>();
  options.trunk_low_m = std::max(kLeastClearance * height_m, (1.0 - kLowered) * height_m + box.min().z());
}

void CheckReachOfTwo(const Dataset& dataset, double reach_m) {
  const double width =
      std::min(dataset.feet()[0].Patch().sizes().minCoeff(), dataset.feet()[1].Patch().sizes().minCoeff());
  Check(std::isfinite(reach_m), "--radius", reach_m, "must be a finite length", "leave it out");
  Check(reach_m > 1.2 * width, "--radius", reach_m,
        "is so small that the feet overlap (a foot is " + std::to_string(width) + " m wide)",
        "leave it out, or use a larger one");
  const double leg = dataset.trunk_height_m();
  Check(reach_m < 1.3 * leg, "--radius", reach_m,
        "exceeds the robot's reach (the trunk is " + std::to_string(leg) + " m above the soles)",
        "leave it out, or use a smaller one");
}

void CheckReachOfMany(const Dataset& dataset, double reach_m) {
  constexpr double kLeast = 0.5;
  constexpr double kMost = 3.0;
  const double span_m = NominalSpan_m(dataset);
  Check(span_m > 0.0, "nominal_posture", span_m, "puts all feet at one place",
        "give each foot a place of its own: edit nominal_posture or contacts, then run 'legopt dataset hash'");
  Check(std::isfinite(reach_m), "--radius", reach_m, "must be a finite length", "leave it out");
  Check(reach_m > kLeast * span_m && reach_m < kMost * span_m, "--radius", reach_m,
        "does not fit the robot, whose feet are up to " + FormatFixed(span_m, 3) + " m apart in its nominal posture",
        "leave it out, or use a value near that distance");
  const double height_m = dataset.trunk_height_m();
  Check(height_m > 0.0, "nominal_posture", height_m, "has the feet above the trunk",
        "bend the legs downwards: edit nominal_posture, then run 'legopt dataset hash'");
}

}  // namespace

ProbeOptions ProbeOptions::For(const Dataset& dataset) {
  constexpr double kAtlasHeight_m = 0.873903;
  ProbeOptions options;
  const double scale = dataset.trunk_height_m() / kAtlasHeight_m;
  options.reach_m *= scale;
  options.step_m *= scale;
  options.trunk_m *= scale;
  options.trunk_low_m *= scale;
  if (dataset.feet().size() != 2) FitToLegs(dataset, options);
  return options;
}

void ProbeOptions::Validate(const Dataset& dataset) const {
  if (dataset.feet().size() < 2) {
    throw InputError(
        {(dataset.folder() / kDatasetFileName).string(), "feet", std::to_string(dataset.feet().size()) + " feet",
         "problems are generated for robots with at least two feet", "name all feet; of two, the left one first"});
  }
  Check(slope_rad > 0.0 && slope_rad <= 1.0, "--slope", slope_rad, "must lie in (0, 1] rad", "the default is 0.45");
  Check(support_m > 0.0, "support", support_m, "must be positive", "the default is 0.003 m");
  Check(trunk_m.minCoeff() > 0.0, "trunk", trunk_m.minCoeff(), "must have positive sides", "leave it out");
  Check(step_m > 0.0, "step", step_m, "must be positive", "leave it out");
  if (dataset.feet().size() == 2) {
    CheckReachOfTwo(dataset, reach_m);
  } else {
    CheckReachOfMany(dataset, reach_m);
  }
}

namespace {

/// Throws InputError for a contact without reach.
std::shared_ptr<const ReachCloud> SampleReach(const Dataset& dataset, std::uint64_t seed) {
  auto reach = std::make_shared<const ReachCloud>(dataset, seed);
  for (int c = 0; c < reach->num_contacts(); ++c) {
    if (!reach->samples(c).empty()) continue;
    throw InputError({(dataset.folder() / kDatasetFileName).string(),
                      "contacts." + dataset.feet()[static_cast<size_t>(c)].name, "",
                      "its sole cannot be level in any posture of the leg, with a level trunk",
                      "check its frame (z points out of the surface, into the robot) and the limits of its joints"});
  }
  return reach;
}

}  // namespace

std::shared_ptr<const ProbeModel> ProbeModel::Build(std::shared_ptr<const Dataset> dataset, const ProbeOptions& options,
                                                    std::uint64_t seed) {
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
  std::shared_ptr<const ReachCloud> reach;
  if (dataset->feet().size() != 2) reach = SampleReach(*dataset, seed);
  return std::make_shared<const ProbeModel>(ProbeModel{std::move(dataset), options, std::move(terrain),
                                                       std::move(parts), std::move(collision), std::move(reach)});
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
  return {.contact = model_->dataset->feet()[static_cast<size_t>(foot)].name,
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
  const Eigen::AlignedBox2d patch = model_->dataset->feet()[static_cast<size_t>(foot)].Patch();
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
  if (normal.z() < std::cos(model_->options.slope_rad)) return false;
  const Contact& contact = model_->dataset->feet()[static_cast<size_t>(foot)];
  if (contact.facts().shape == ContactShape::kBall) {
    constexpr double kSlack_m = 5e-5;
    const Eigen::Translation3d centre(foothold.position + (BallRadius_m(contact) + kPointClearance_m) * normal);
    return PartDistance(1 + foot, Isometry3d(centre), kPointClearance_m) >= kPointClearance_m - kSlack_m;
  }
  const double clearance = model_->options.clearance_m;
  return Supported(foot, foothold) &&
         PartDistance(1 + foot, model_->dataset->LinkTarget(foothold), clearance) >= clearance;
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

std::vector<ReachCloud::Placement> PlacementsOf(const Dataset& dataset, const Stance& stance) {
  std::vector<ReachCloud::Placement> placements;
  for (const ContactTarget& target : stance.contacts) {
    const auto& contacts = dataset.feet();
    const auto found = std::find_if(contacts.begin(), contacts.end(),
                                    [&](const Contact& contact) { return contact.name == target.contact; });
    placements.push_back({static_cast<int>(found - contacts.begin()), target.position});
  }
  return placements;
}

TrunkPose StanceProbe::TrunkOver(const Stance& stance) const {
  Vector3d centre = Vector3d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  for (const ContactTarget& foothold : stance.contacts) {
    centre += foothold.position / static_cast<double>(stance.contacts.size());
    const double yaw = Yaw(foothold);
    heading += Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
  }
  const double yaw_rad = std::atan2(heading.y(), heading.x());
  if (model_->reach) return model_->reach->Fit(PlacementsOf(*model_->dataset, stance), yaw_rad);
  return {.position = centre.head<2>(), .yaw_rad = yaw_rad, .ground_m = centre.z()};
}

double StanceProbe::TrunkDistance(const TrunkPose& pose, double margin_m) {
  const ProbeOptions& options = model_->options;
  const Eigen::Vector2d at = model_->reach ? pose.At(options.trunk_centre_m) : pose.position;
  const Vector3d centre(at.x(), at.y(), pose.ground_m + (options.trunk_low_m + 0.5 * options.trunk_m.z()));
  return PartDistance(model_->trunk_link(),
                      Eigen::Translation3d(centre) * Eigen::AngleAxisd(pose.yaw_rad, Vector3d::UnitZ()), margin_m);
}

double StanceProbe::TrunkDistance(const Stance& stance, double margin_m) {
  return TrunkDistance(TrunkOver(stance), margin_m);
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
  if (dataset.feet().size() != 2) return;
  constexpr double kSide_m = 1e-3;  // feet placed one behind the other have no lateral order
  const Contact& first = dataset.feet().at(0);
  const Contact& second = dataset.feet().at(1);
  Kinematics kinematics(dataset.robot());
  kinematics.Update(NominalConfiguration(dataset));
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
