// The reconstructed garage as convex solids: feet on surfaces must not penetrate them, and solid parts must be filled.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/ode_world.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

/// Measures the deepest penetration (> 0) of a foot mesh's hull into the solids over many placements.
class FootProbe {
 public:
  FootProbe(const std::vector<ConvexShape>& solids, const TriangleMesh& foot) : solids_(solids), foot_(foot) {
    for (const ConvexShape& solid : solids_) {
      placed_.push_back(std::make_unique<PlacedShape>(solid, Eigen::Isometry3d::Identity()));
      sets_.push_back(placed_.back()->set());
    }
    world_ = std::make_unique<OdeConvexWorld>(solids_, sets_, none_);
  }

  double Depth(const Eigen::Isometry3d& pose) {
    const PlacedShape foot(Hull(foot_.vertices), pose);
    world_->CollectSolids(SupportBounds(foot.set()), near_);
    double depth = 0.0;
    PairDistance distance;
    for (int solid : near_) {
      if (SignedDistance(foot.set(), sets_[static_cast<size_t>(solid)], 0.0, distance)) {
        depth = std::max(depth, -distance.distance_m);
      }
    }
    return depth;
  }

 private:
  const std::vector<ConvexShape>& solids_;
  TriangleMesh foot_;
  std::vector<std::unique_ptr<PlacedShape>> placed_;
  std::vector<SupportSet> sets_;
  std::vector<SupportSet> none_;
  std::unique_ptr<OdeConvexWorld> world_;
  std::vector<int> near_;
};

TEST(Garage, SolidsAreReasonableInNumberAndSize) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  const std::vector<ConvexShape> solids = SolidsOfMesh(LoadMesh(GarageFile()), {});
  EXPECT_GT(solids.size(), 500U);
  EXPECT_LT(solids.size(), 4000U);
  size_t most = 0;
  for (const ConvexShape& solid : solids) most = std::max(most, solid.points().size());
  EXPECT_LT(most, 256U);
  RecordProperty("solids", static_cast<int>(solids.size()));
}

TEST(Garage, NoFootPlacementOfTheBenchmarkIsBuried) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const std::vector<ConvexShape> solids = SolidsOfMesh(LoadMesh(GarageFile()), {});
  std::map<std::string, FootProbe> probes;
  for (const std::string foot : {"l_foot", "r_foot"}) {
    const Link& link = robot.links()[static_cast<size_t>(robot.FindLink(foot))];
    probes.try_emplace(foot, solids, Tessellate(link.collision.at(0)));
  }
  std::map<std::tuple<std::string, double, double, double>, double> done;
  int placements = 0;
  double deepest = 0.0;
  for (const char* file : {"problemsposture.json", "problemsmotion.json"}) {
    LEGOPT_REQUIRE_FILE(DataFolder() / file);
    for (const auto& stance : ReadStances(DataFolder() / file)) {
      for (const ContactPose& sole : stance) {
        ++placements;
        const auto key = std::tuple(sole.link, sole.position.x(), sole.position.y(), sole.position.z());
        if (done.count(key) > 0) continue;
        const double depth = probes.at(sole.link).Depth(FootFrame(sole));
        done[key] = depth;
        deepest = std::max(deepest, depth);
        EXPECT_LE(depth, 1e-3) << sole.link << " at " << sole.position.transpose();
      }
    }
  }
  EXPECT_GT(placements, 10000);
  RecordProperty("placements", placements);
  RecordProperty("deepest_um", static_cast<int>(1e6 * deepest));
}

/// Returns whether the ray first meets the mesh at least `thickness` away, so that the part is thick there.
bool ThickBelow(const TriangleMesh& mesh, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                double thickness) {
  for (const auto& t : mesh.triangles) {
    const auto at = [&](size_t k) { return mesh.vertices[static_cast<size_t>(t[k])]; };
    const Eigen::Vector3d e1 = at(1) - at(0);
    const Eigen::Vector3d e2 = at(2) - at(0);
    const Eigen::Vector3d p = direction.cross(e2);
    const double det = e1.dot(p);
    if (std::abs(det) < 1e-15) continue;
    const Eigen::Vector3d s = origin - at(0);
    const double u = s.dot(p) / det;
    const Eigen::Vector3d q = s.cross(e1);
    const double v = direction.dot(q) / det;
    const double distance = e2.dot(q) / det;
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-5 && distance < thickness) return false;
  }
  return true;
}

TEST(Garage, WhatIsSolidInTheMeshIsSolidInTheModel) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  const TriangleMesh mesh = LoadMesh(GarageFile());
  const std::vector<ConvexShape> solids = SolidsOfMesh(mesh, {});
  constexpr double kInwards = 5e-3;
  constexpr double kSpacing = 0.5;  // m^2 per sample
  Draw draw(31);
  int samples = 0;
  int covered = 0;
  for (const TriangleMesh& part : SplitIntoComponents(mesh)) {
    for (const auto& t : part.triangles) {
      const auto at = [&](size_t k) { return part.vertices[static_cast<size_t>(t[k])]; };
      const Eigen::Vector3d cross = (at(1) - at(0)).cross(at(2) - at(0));
      if (cross.norm() < 1e-4) continue;
      const Eigen::Vector3d inward = -cross.normalized();
      for (int i = 0; i < 1 + static_cast<int>(0.5 * cross.norm() / kSpacing); ++i) {
        double u = draw.Number(0, 1);
        double v = draw.Number(0, 1);
        if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
        const Eigen::Vector3d surface = at(0) + u * (at(1) - at(0)) + v * (at(2) - at(0));
        if (!ThickBelow(part, surface, inward, 2.0 * kInwards)) continue;
        ++samples;
        const Eigen::Vector3d inside = surface + kInwards * inward;
        covered += std::any_of(solids.begin(), solids.end(), [&](const ConvexShape& solid) {
          return solid.bounds().contains(inside) && solid.BoundaryDistance(inside) <= 0.0;
        });
      }
    }
  }
  const double percent = 100.0 * covered / samples;
  RecordProperty("samples", samples);
  RecordProperty("covered_percent", std::to_string(percent));
  EXPECT_GT(samples, 10000);
  EXPECT_GT(percent, 99.5);
}

}  // namespace
}  // namespace legopt::test
