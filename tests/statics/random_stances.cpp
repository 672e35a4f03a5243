#include "tests/statics/random_stances.h"

#include <Eigen/Geometry>
#include <numbers>

namespace legopt::test {
namespace {

double Uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

int Index(std::mt19937_64& random, int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); }

Eigen::Matrix3d Axes(double tilt_rad, double heading_rad, double turn_rad) {
  return (Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

Eigen::Matrix3d RandomAxes(std::mt19937_64& random) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double tilt = Index(random, 6) == 0 ? 90.0 : Uniform(random, 0.0, 75.0);
  return Axes(tilt * kDegree, Uniform(random, 0.0, 2.0 * std::numbers::pi),
              Uniform(random, 0.0, 2.0 * std::numbers::pi));
}

}  // namespace

std::vector<TouchedSurface> RandomSurfaces(std::mt19937_64& random) {
  std::vector<TouchedSurface> surfaces(1 + static_cast<size_t>(Index(random, 4)));
  for (TouchedSurface& surface : surfaces) {
    surface.axes_W = RandomAxes(random);
    surface.friction = Uniform(random, 0.2, 1.0);
    if (Index(random, 5) == 0) surface.max_normal = Uniform(random, 0.1, 1.0);
    const Eigen::Vector3d centre(Uniform(random, -0.5, 0.5), Uniform(random, -0.5, 0.5), Uniform(random, 0.0, 0.8));
    const int points = 1 + Index(random, 4);
    for (int k = 0; k < points; ++k) {
      surface.points_W.emplace_back(
          centre + surface.axes_W * Eigen::Vector3d(Uniform(random, -0.12, 0.12), Uniform(random, -0.07, 0.07), 0.0));
    }
  }
  return surfaces;
}

std::vector<TouchedSurface> RandomSurfacesAndBars(std::mt19937_64& random) {
  std::vector<TouchedSurface> surfaces = RandomSurfaces(random);
  for (TouchedSurface& surface : surfaces) {
    if (Index(random, 2) == 0) continue;
    surface.max_component = Uniform(random, 0.05, 0.5);
    surface.max_normal.reset();
    const Eigen::Vector3d centre = surface.points_W.front();
    surface.points_W = {centre + 0.03 * surface.axes_W.col(0), centre - 0.03 * surface.axes_W.col(0)};
  }
  return surfaces;
}

std::vector<TouchedSurface> DegenerateSurfaces(std::mt19937_64& random) {
  std::vector<TouchedSurface> surfaces;
  const auto add = [&](const Eigen::Matrix3d& axes_W, std::vector<Eigen::Vector3d> points_W) {
    TouchedSurface& surface = surfaces.emplace_back();
    surface.axes_W = axes_W;
    surface.friction = 0.5;
    // Without a bound, exact arithmetic holds anything between opposite surfaces: forces of 1e16 weights make use of
    // the rounding of the normals.
    surface.max_normal = 100.0;
    surface.points_W = std::move(points_W);
  };
  const Eigen::Vector3d at(Uniform(random, -0.3, 0.3), Uniform(random, -0.3, 0.3), Uniform(random, 0.0, 0.5));
  const Eigen::Vector3d step(Uniform(random, 0.1, 0.4), Uniform(random, -0.3, 0.3), 0.0);
  const Eigen::Matrix3d level = Axes(0.0, 0.0, Uniform(random, 0.0, 6.0));
  constexpr double kRight = std::numbers::pi / 2.0;
  switch (Index(random, 8)) {
    case 0:
      add(level, {at});
      break;
    case 1:
      add(level, {at, at + step});
      break;
    case 2:
      add(level, {at, at + step, at + 2.0 * step});
      break;
    case 3:
      add(level, {at, at, at + step, at + step});
      break;
    case 4: {  // opposite walls
      const double heading = Uniform(random, 0.0, 6.0);
      const Eigen::Vector3d across(std::cos(heading), std::sin(heading), 0.0);
      add(Axes(kRight, heading, 0.0), {at - 0.4 * across});
      add(Axes(-kRight, heading, 0.0), {at + 0.4 * across});
      break;
    }
    case 5:  // floor and ceiling
      add(level, {at, at + step});
      add(Axes(2.0 * kRight, 0.0, 0.0), {at + Eigen::Vector3d(0.0, 0.1, 1.0)});
      break;
    case 6: {  // a patch of 0.2 mm
      const double half = 1e-4;
      add(level, {at + Eigen::Vector3d(half, half, 0), at + Eigen::Vector3d(half, -half, 0),
                  at + Eigen::Vector3d(-half, half, 0), at + Eigen::Vector3d(-half, -half, 0)});
      break;
    }
    default:  // a slope at exactly the friction angle
      add(Axes(std::atan(0.5), 0.0, 0.0), {at, at + Axes(std::atan(0.5), 0.0, 0.0) * Eigen::Vector3d(0.1, 0.1, 0.0)});
      break;
  }
  return surfaces;
}

Eigen::Vector3d RandomCom(const std::vector<TouchedSurface>& surfaces, std::mt19937_64& random) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const TouchedSurface& surface : surfaces) {
    for (const Eigen::Vector3d& point_W : surface.points_W) {
      mean += point_W;
      count += 1.0;
    }
  }
  return mean / count +
         Eigen::Vector3d(Uniform(random, -0.3, 0.3), Uniform(random, -0.3, 0.3), Uniform(random, 0.4, 1.0));
}

}  // namespace legopt::test
