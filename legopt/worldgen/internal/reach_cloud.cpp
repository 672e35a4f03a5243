#include "legopt/worldgen/internal/reach_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "legopt/math/random_numbers.h"
#include "legopt/robot/internal/smallest_rotation.h"
#include "legopt/robot/kinematics.h"
#include "legopt/worldgen/internal/seeds.h"

namespace legopt::worldgen {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Returns the place of a contact whose link is at `X_TL` relative to the trunk.
ReachSample PlaceOf(const Contact& contact, const Isometry3d& X_TL) {
  const Isometry3d X_TC = X_TL * contact.X_LC;
  if (contact.facts().shape != ContactShape::kBall) {
    const Vector3d forward = X_TC.linear().col(0);
    return {X_TC.translation(), std::atan2(forward.y(), forward.x())};
  }
  // A point contact may turn: the centre of its ball stays above the surface by the same height.
  return {X_TC.translation() - (contact.radius_m + kPointClearance_m) * Vector3d::UnitZ(), 0.0};
}

/// Returns the degrees of freedom on the chain between two links: first those from the base to `link`.
std::vector<int> DofsBetween(const RobotModel& robot, int trunk, int link) {
  const std::vector<int>& from = robot.body_chain(robot.link_body(trunk));
  const std::vector<int>& to = robot.body_chain(robot.link_body(link));
  std::vector<int> chain;
  for (const auto& [bodies, others] : {std::pair(&to, &from), std::pair(&from, &to)}) {
    for (const int body : *bodies) {
      if (std::find(others->begin(), others->end(), body) != others->end()) continue;
      const int dof = robot.joints()[static_cast<std::size_t>(robot.body_joint(body))].dof;
      if (std::find(chain.begin(), chain.end(), dof) == chain.end()) chain.push_back(dof);
    }
  }
  return chain;
}

}  // namespace

ReachCloud::ReachCloud(const Dataset& dataset, std::uint64_t seed) : legs_(dataset.feet().size()) {
  Kinematics kinematics(dataset.robot());
  Eigen::VectorXd x = dataset.self_collision_reference();  // its base is at the origin
  x.head(dataset.nominal_joints().size()) = dataset.nominal_joints();
  kinematics.Update(x);
  com_ = (kinematics.com() - dataset.trunk().nominal_position_B).head<2>();
  for (int c = 0; c < num_contacts(); ++c) {
    const Contact& contact = dataset.feet()[Index(c)];
    legs_[Index(c)].nominal = PlaceOf(contact, dataset.trunk().PoseOf(contact.link_index, kinematics));
    SampleLeg(dataset, c, seed);
    FillCells(legs_[Index(c)]);
  }
  ChooseHeight();
}

void ReachCloud::SampleLeg(const Dataset& dataset, int contact, std::uint64_t seed) {
  constexpr int kTriesPerSample = 50;
  const RobotModel& robot = dataset.robot();
  const Contact& description = dataset.feet()[Index(contact)];
  const std::vector<int> chain = DofsBetween(robot, dataset.trunk().link, description.link_index);
  std::mt19937_64 generator(DeriveSeed(seed, "reach/" + description.name));
  Kinematics kinematics(robot);
  Eigen::VectorXd x = dataset.self_collision_reference();
  x.head(dataset.nominal_joints().size()) = dataset.nominal_joints();
  std::vector<ReachSample>& samples = legs_[Index(contact)].samples;
  for (int k = 0; k < kSamples * kTriesPerSample && std::ssize(samples) < kSamples; ++k) {
    for (const int dof : chain) {
      const double low = std::max(robot.lower_limits()[dof], -M_PI);
      const double high = std::min(robot.upper_limits()[dof], M_PI);
      x[dof] = low + (high - low) * UniformRandom(generator);
    }
    kinematics.UpdatePoses(x);
    const Isometry3d X_TL = dataset.trunk().PoseOf(description.link_index, kinematics);
    const bool level = (X_TL * description.X_LC).linear()(2, 2) >= std::cos(kMaxTilt_rad);
    if (description.facts().shape == ContactShape::kBall || level) samples.push_back(PlaceOf(description, X_TL));
  }
}

/// Marks the cells near the samples. The ball's radius is 6 % of the cloud's longest side, where a ball holds about ten
/// samples of a leg with three joints.
void ReachCloud::FillCells(Leg& leg) {
  constexpr double kBall = 0.06;
  constexpr int kCellsPerBall = 2;
  if (leg.samples.empty()) return;
  Eigen::AlignedBox3d box;
  for (const ReachSample& sample : leg.samples) box.extend(sample.position);
  const double ball_m = std::max(1e-3, kBall * box.sizes().maxCoeff());
  leg.cell_m = ball_m / kCellsPerBall;
  leg.origin = box.min().array() - ball_m;
  leg.cells = ((box.sizes().array() + 2.0 * ball_m) / leg.cell_m).ceil().cast<int>().max(1);
  leg.reached.assign(static_cast<std::size_t>(leg.cells.x()) * static_cast<std::size_t>(leg.cells.y()) *
                         static_cast<std::size_t>(leg.cells.z()),
                     false);
  constexpr int kWidth = 2 * kCellsPerBall + 1;
  for (const ReachSample& sample : leg.samples) {
    const Eigen::Vector3i centre = ((sample.position - leg.origin) / leg.cell_m).array().floor().cast<int>();
    for (int k = 0; k < kWidth * kWidth * kWidth; ++k) {
      const Eigen::Vector3i offset(k % kWidth - kCellsPerBall, k / kWidth % kWidth - kCellsPerBall,
                                   k / (kWidth * kWidth) - kCellsPerBall);
      const Eigen::Vector3i cell = centre + offset;
      if ((cell.array() < 0).any() || (cell.array() >= leg.cells.array()).any()) continue;
      const Vector3d middle = leg.origin + leg.cell_m * (cell.cast<double>() + Vector3d::Constant(0.5));
      if ((middle - sample.position).norm() > ball_m) continue;
      leg.reached[static_cast<std::size_t>((cell.z() * leg.cells.y() + cell.y()) * leg.cells.x() + cell.x())] = true;
    }
  }
}

bool ReachCloud::Reaches(int contact, const Vector3d& point) const {
  const Leg& leg = legs_[Index(contact)];
  if (leg.samples.empty()) return false;
  const Eigen::Array3d place = ((point - leg.origin) / leg.cell_m).array().floor();
  if ((place < 0.0).any() || (place >= leg.cells.cast<double>().array()).any()) return false;
  const Eigen::Array3i cell = place.cast<int>();
  return leg.reached[static_cast<std::size_t>((cell.z() * leg.cells.y() + cell.y()) * leg.cells.x() + cell.x())];
}

/// Returns the largest distance that a contact can move in eight directions from its nominal place.
double ReachCloud::StrideOf(int contact, double height_m) const {
  constexpr int kDirections = 8;
  constexpr double kStep = 0.02;
  const Vector2d centre = nominal(contact).position.head<2>();
  const auto reaches = [&](double radius_m) {
    for (int k = 0; k < kDirections; ++k) {
      const Vector2d at = centre + Eigen::Rotation2Dd(2.0 * M_PI * k / kDirections) * Vector2d(radius_m, 0.0);
      if (!Reaches(contact, {at.x(), at.y(), -height_m})) return false;
    }
    return true;
  };
  double radius_m = 0.0;
  while (radius_m < height_m && reaches(radius_m + kStep * height_m)) radius_m += kStep * height_m;
  return radius_m;
}

double ReachCloud::StrideAt(double height_m) const {
  double stride_m = height_m;
  for (int c = 0; c < num_contacts(); ++c) stride_m = std::min(stride_m, StrideOf(c, height_m));
  return stride_m;
}

int ReachCloud::limiting_contact() const {
  int limiting = 0;
  for (int c = 1; c < num_contacts(); ++c) {
    if (StrideOf(c, height_m_) < StrideOf(limiting, height_m_)) limiting = c;
  }
  return limiting;
}

/// Chooses the height of the trunk: the nominal one, unless another one gives a much longer stride.
void ReachCloud::ChooseHeight() {
  double nominal_m = 0.0;
  for (const Leg& leg : legs_) nominal_m -= leg.nominal.position.z() / static_cast<double>(legs_.size());
  height_m_ = nominal_m;
  stride_m_ = StrideAt(nominal_m);
  constexpr double kMuchLonger = 1.4;
  double longest_m = kMuchLonger * stride_m_;
  for (const double share : {0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5}) {
    const double stride_m = StrideAt(share * nominal_m);
    if (stride_m <= longest_m) continue;
    longest_m = stride_m;
    stride_m_ = stride_m;
    height_m_ = share * nominal_m;
  }
}

double ReachCloud::span_m() const {
  double span_m = 0.0;
  for (const Leg& a : legs_) {
    for (const Leg& b : legs_) {
      span_m = std::max(span_m, (a.nominal.position - b.nominal.position).head<2>().norm());
    }
  }
  return span_m;
}

TrunkPose ReachCloud::Fit(std::span<const Placement> placements, double yaw_hint_rad) const {
  const auto count = static_cast<double>(placements.size());
  TrunkPose pose{.yaw_rad = yaw_hint_rad};
  Vector2d here = Vector2d::Zero(), there = Vector2d::Zero();  // means, in the world and relative to the trunk
  for (const Placement& placement : placements) {
    here += placement.position.head<2>() / count;
    there += nominal(placement.contact).position.head<2>() / count;
    pose.ground_m += placement.position.z() / count;
  }
  double sine = 0.0, cosine = 0.0;
  for (const Placement& placement : placements) {
    const Vector2d a = nominal(placement.contact).position.head<2>() - there;
    const Vector2d b = placement.position.head<2>() - here;
    cosine += a.dot(b);
    sine += a.x() * b.y() - a.y() * b.x();
  }
  if (placements.size() > 1) pose.yaw_rad = std::atan2(sine, cosine);
  pose.position = here - Eigen::Rotation2Dd(pose.yaw_rad) * there;
  return pose;
}

bool ReachCloud::ReachesAll(std::span<const Placement> placements, const TrunkPose& pose) const {
  // Plane z = ground + a x + b y in axes of the trunk, by least squares.
  Eigen::Matrix2d squares = 1e-9 * Eigen::Matrix2d::Identity();
  Vector2d products = Vector2d::Zero();
  std::vector<Vector3d> points;
  for (const Placement& placement : placements) {
    const Vector2d at = Eigen::Rotation2Dd(-pose.yaw_rad) * (placement.position.head<2>() - pose.position);
    points.emplace_back(at.x(), at.y(), placement.position.z() - pose.ground_m);
    squares += at * at.transpose();
    products += at * points.back().z();
  }
  const Vector2d slope = squares.ldlt().solve(products);
  const Vector3d normal = Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const std::array<Eigen::Quaterniond, 2> tilts = {Eigen::Quaterniond::Identity(),
                                                   SmallestRotation(normal, Vector3d::UnitZ())};
  const std::size_t count = placements.size() > 2 ? tilts.size() : 1;
  for (const double share : {1.0, 0.9, 0.8, 1.1, 0.7}) {
    for (std::size_t t = 0; t < count; ++t) {
      const bool all = std::equal(points.begin(), points.end(), placements.begin(),
                                  [&](const Vector3d& point, const Placement& placement) {
                                    const Vector3d below = tilts.at(t) * point - share * height_m_ * Vector3d::UnitZ();
                                    return Reaches(placement.contact, below);
                                  });
      if (all) return true;
    }
  }
  return false;
}

}  // namespace legopt::worldgen
