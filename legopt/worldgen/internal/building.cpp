#include "legopt/worldgen/internal/building.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"

namespace legopt::worldgen {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::string_view ToString(BuildingKind kind) { return kind == BuildingKind::kGarage ? "garage" : "house"; }

BuildingKind ParseBuildingKind(std::string_view text) {
  for (const BuildingKind kind : {BuildingKind::kGarage, BuildingKind::kHouse}) {
    if (text == ToString(kind)) return kind;
  }
  throw InputError({"--kind", "", std::string(text), "unknown kind of building",
                    SuggestName(std::string(text), std::vector<std::string>{"garage", "house"})});
}

Member& BuildingParts::Hull(std::string name, std::vector<Vector3d> corners, Material material, double cell_m) {
  Member member;
  member.name = std::move(name);
  member.corners = std::move(corners);
  member.material = material;
  member.cell_m = cell_m;
  building_->members.push_back(std::move(member));
  return building_->members.back();
}

Member& BuildingParts::Box(std::string name, const Vector3d& low, const Vector3d& high, Material material,
                           double cell_m) {
  return TurnedBox(std::move(name), 0.5 * (low + high), high - low, 0.0, material, cell_m);
}

Member& BuildingParts::TurnedBox(std::string name, const Vector3d& centre, const Vector3d& size, double yaw_rad,
                                 Material material, double cell_m) {
  std::vector<Vector3d> corners;
  const double c = std::cos(yaw_rad);
  const double s = std::sin(yaw_rad);
  for (const double z : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double x : {-0.5, 0.5}) {
        const Vector3d d = size.cwiseProduct(Vector3d(x, y, z));
        corners.emplace_back(centre + Vector3d(c * d.x() - s * d.y(), s * d.x() + c * d.y(), d.z()));
      }
    }
  }
  return Hull(std::move(name), std::move(corners), material, cell_m);
}

void BuildingParts::Car(const std::string& name, const Vector3d& foot, double yaw_rad) {
  const int prop = next_prop_++;
  const Eigen::Isometry3d pose = Eigen::Translation3d(foot) * Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
  const auto add = [&](const std::string& part, const std::vector<Vector2d>& profile_xz, double y_low, double y_high) {
    std::vector<Vector3d> corners;
    for (const Vector2d& p : profile_xz) {
      corners.emplace_back(pose * Vector3d(p.x(), y_low, p.y()));
      corners.emplace_back(pose * Vector3d(p.x(), y_high, p.y()));
    }
    Hull(name + "-" + part, std::move(corners), Material::kCar, 0.0).prop = prop;
  };
  constexpr double kHalf = 0.86;   // half width of the body, m
  constexpr double kRoof = 0.72;   // half width of the cabin, m
  constexpr double kWheel = 0.31;  // radius of a wheel, m
  add("body", {{-2.05, 0.22}, {2.0, 0.22}, {2.1, 0.45}, {2.05, 0.68}, {1.0, 0.82}, {-2.0, 0.86}, {-2.12, 0.5}}, -kHalf,
      kHalf);
  add("cabin", {{-1.85, 0.84}, {1.0, 0.82}, {0.35, 1.36}, {-1.25, 1.42}}, -kRoof, kRoof);
  int wheel = 0;
  for (const double x : {-1.3, 1.32}) {
    for (const double y : {-kHalf, kHalf - 0.2}) {
      std::vector<Vector2d> rim;
      for (int k = 0; k < 10; ++k) {
        const double angle = (k + 0.5) * 2.0 * M_PI / 10.0;
        rim.emplace_back(x + kWheel * std::cos(angle), std::max(0.0, kWheel * (1.0 + std::sin(angle)) - 0.015));
      }
      add("wheel-" + std::to_string(wheel++), rim, y - 0.01, y + 0.21);
    }
  }
}

void BuildingParts::Person(const std::string& name, const Vector3d& foot, double yaw_rad, bool lying) {
  const int prop = next_prop_++;
  Eigen::Isometry3d pose = Eigen::Translation3d(foot) * Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
  if (lying) pose = pose * Eigen::Translation3d(0.0, 0.0, 0.14) * Eigen::AngleAxisd(M_PI_2, Vector3d::UnitY());
  const auto add = [&](const std::string& part, const Vector3d& low, const Vector3d& high, double taper) {
    std::vector<Vector3d> corners;
    for (int i = 0; i < 8; ++i) {
      Vector3d corner((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                      (i & 4) != 0 ? high.z() : low.z());
      if ((i & 4) == 0)
        corner.head<2>() = 0.5 * (low + high).head<2>() + taper * (corner - 0.5 * (low + high)).head<2>();
      corners.emplace_back(pose * corner);
    }
    Hull(name + "-" + part, std::move(corners), Material::kPerson, 0.0).prop = prop;
  };
  constexpr double kSlim = 0.7;
  add("left-leg", {-0.08, 0.02, 0.0}, {0.08, 0.17, 0.84}, kSlim);
  add("right-leg", {-0.08, -0.17, 0.0}, {0.08, -0.02, 0.84}, kSlim);
  add("trunk", {-0.12, -0.2, 0.84}, {0.12, 0.2, 1.42}, 0.85);
  add("left-arm", {-0.06, 0.21, 0.72}, {0.06, 0.31, 1.4}, kSlim);
  add("right-arm", {-0.06, -0.31, 0.72}, {0.06, -0.21, 1.4}, kSlim);
  add("head", {-0.1, -0.08, 1.47}, {0.1, 0.08, 1.72}, kSlim);
}

void BuildingParts::Wall(const std::string& name, const Vector3d& low, const Vector3d& high, Material material,
                         double cell_m, const std::vector<Opening>& openings) {
  const int axis = high.x() - low.x() >= high.y() - low.y() ? 0 : 1;
  int part = 0;
  const auto piece = [&](double from, double to, double bottom, double top) {
    constexpr double kLeast = 0.02;
    if (to - from < kLeast || top - bottom < kLeast) return;
    Vector3d a = low;
    Vector3d b = high;
    a[axis] = low[axis] + from;
    b[axis] = low[axis] + to;
    a.z() = low.z() + bottom;
    b.z() = low.z() + top;
    Box(name + "-" + std::to_string(part++), a, b, material, cell_m);
  };
  const double length = high[axis] - low[axis];
  const double height = high.z() - low.z();
  double at = 0.0;
  for (const Opening& opening : openings) {
    piece(at, opening.from_m, 0.0, height);
    piece(opening.from_m, opening.to_m, 0.0, opening.sill_m);
    piece(opening.from_m, opening.to_m, opening.head_m, height);
    at = opening.to_m;
  }
  piece(at, length, 0.0, height);
}

double Building::FocusDistance(const Vector3d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& focus : foci) nearest = std::min(nearest, (point - focus).norm());
  return nearest;
}

Building MakeBuilding(BuildingKind kind, std::uint64_t seed) {
  return kind == BuildingKind::kGarage ? MakeGarage(seed) : MakeHouse(seed);
}

}  // namespace legopt::worldgen
