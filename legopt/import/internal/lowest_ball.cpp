#include "legopt/import/internal/lowest_ball.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

namespace legopt {
namespace {

/// Returns the ball that fits the points best: least squares of |p - c|^2 - r^2. Nothing for fewer than four points,
/// and for points in a plane.
std::optional<Ball> FittedBall(const std::vector<Eigen::Vector3d>& points) {
  constexpr std::size_t kLeastPoints = 4;
  if (points.size() < kLeastPoints) return {};
  Eigen::MatrixXd rows(points.size(), 4);
  Eigen::VectorXd right(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d p = points[i] - points.front();
    rows.row(row) << 2.0 * p.transpose(), 1.0;
    right[row] = p.squaredNorm();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(rows);
  if (solver.rank() < rows.cols()) return {};
  const Eigen::Vector4d solution = solver.solve(right);
  const double square = solution[3] + solution.head<3>().squaredNorm();
  if (!(square > 0.0)) return {};
  return Ball{.centre = solution.head<3>() + points.front(), .radius_m = std::sqrt(square)};
}

/// Returns true if the triangles near the lowest point follow a ball: the rims of a cylinder and the corners of a box
/// lie on a ball as well, but their faces do not.
bool FollowBall(const std::vector<Triangle>& triangles, const Eigen::Vector3d& up, double ceiling, const Ball& ball) {
  constexpr double kLeast_m = 1e-3, kShare = 0.04;  // a ball of 16 x 8 faces deviates by 4 % of its radius
  const double most_m = std::max(kLeast_m, kShare * ball.radius_m);
  return std::ranges::all_of(triangles, [&](const Triangle& t) {
    const auto above = [&](const Eigen::Vector3d& p) { return up.dot(p) >= ceiling; };
    if (std::ranges::any_of(t, above)) return true;
    const Eigen::Vector3d middle = (t[0] + t[1] + t[2]) / 3.0;
    return std::abs((middle - ball.centre).norm() - ball.radius_m) <= most_m;
  });
}

/// Returns the middle of the longest edge that is as low as the lowest point, as of a cylinder that lies; nothing
/// without one.
std::optional<Eigen::Vector3d> LowestEdge(const std::vector<Triangle>& triangles, const Eigen::Vector3d& up,
                                          double lowest) {
  constexpr double kLevel_m = 1e-4;
  std::optional<Eigen::Vector3d> middle;
  double longest_m = 0.0;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < t.size(); ++k) {
      const Eigen::Vector3d &a = t.at(k), &b = t.at((k + 1) % t.size());
      if (std::max(up.dot(a), up.dot(b)) > lowest + kLevel_m || (b - a).norm() <= longest_m) continue;
      longest_m = (b - a).norm();
      middle = 0.5 * (a + b);
    }
  }
  return middle;
}

}  // namespace

Ball LowestBall(const std::vector<Eigen::Vector3d>& points, const std::vector<Triangle>& triangles,
                const Eigen::Vector3d& up) {
  constexpr double kLargest_m = 0.1, kDeviation_m = 1e-3;
  constexpr std::array kBands_m = {0.02, 0.01, 0.005};  // heights above the lowest point
  const auto height = [&](const Eigen::Vector3d& p) { return up.dot(p); };
  const Eigen::Vector3d lowest = *std::ranges::min_element(points, {}, height);
  for (const double band_m : kBands_m) {
    std::vector<Eigen::Vector3d> near;
    for (const Eigen::Vector3d& p : points) {
      if (height(p) < height(lowest) + band_m) near.push_back(p);
    }
    const std::optional<Ball> ball = FittedBall(near);
    if (!ball || ball->radius_m > kLargest_m) continue;
    const auto fits = [&](const Eigen::Vector3d& p) {
      return std::abs((p - ball->centre).norm() - ball->radius_m) <= kDeviation_m;
    };
    const double ceiling = height(lowest) + band_m;
    if (std::ranges::all_of(near, fits) && FollowBall(triangles, up, ceiling, *ball)) return *ball;
  }
  return {.centre = LowestEdge(triangles, up, height(lowest)).value_or(lowest)};
}

}  // namespace legopt
