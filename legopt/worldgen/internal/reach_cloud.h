#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "legopt/dataset/dataset.h"

namespace legopt::worldgen {

/// Pose of the trunk (dataset.h) over the ground, upright or tilted with the contacts.
struct TrunkPose {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< position of its origin in plan, m
  double yaw_rad = 0.0;                                ///< its heading
  double ground_m = 0.0;                               ///< mean height of the contacts

  /// Returns the point of the plan that is `offset` away from the origin, in axes of the trunk.
  Eigen::Vector2d At(const Eigen::Vector2d& offset) const { return position + Eigen::Rotation2Dd(yaw_rad) * offset; }
  /// Returns the pose moved by `offset` in its own axes and turned by `turn_rad`.
  TrunkPose Moved(const Eigen::Vector2d& offset, double turn_rad) const {
    return {At(offset), yaw_rad + turn_rad, ground_m};
  }
};

/// Place that a leg can reach, relative to the trunk.
struct ReachSample {
  Eigen::Vector3d position;  ///< point under the contact, in the trunk's frame, m
  double yaw_rad = 0.0;      ///< heading of the contact frame in the trunk's; 0 for a point contact
};

/// Places that each contact of a robot can reach, from sampled postures of its leg.
///
/// Samples take joint values uniform within their limits (unlimited joints: one turn), on the chain from the trunk to
/// the contact only. For a sole, samples that tilt it by more than kMaxTilt_rad against the trunk are left out. Reach
/// is the union of balls around the samples. Self-collision and balance are ignored, so that reach is necessary for a
/// posture, not sufficient.
///
/// Depends on robot, contacts, nominal posture and seed only. Immutable and thread-safe.
class ReachCloud {
 public:
  static constexpr int kSamples = 4096;        ///< number of samples per contact
  static constexpr double kMaxTilt_rad = 0.8;  ///< maximum tilt of a sole against the trunk

  /// Samples all contacts of the dataset.
  ReachCloud(const Dataset& dataset, std::uint64_t seed);

  /// Returns the samples of a contact; empty if its sole cannot point downwards.
  const std::vector<ReachSample>& samples(int contact) const { return legs_[Index(contact)].samples; }
  /// Place of a contact in the nominal posture.
  const ReachSample& nominal(int contact) const { return legs_[Index(contact)].nominal; }
  /// Returns true if the contact can be at a point given in the trunk's frame.
  bool Reaches(int contact, const Eigen::Vector3d& point) const;

  int num_contacts() const { return static_cast<int>(legs_.size()); }  ///< number of contacts
  /// Height of the trunk over the contacts at which the legs have the widest reach, m.
  double height_m() const { return height_m_; }
  /// Distance, m, that every contact can move to all sides of its nominal place with the trunk at height_m().
  double stride_m() const { return stride_m_; }
  /// Returns the contact with the shortest stride, which limits stride_m().
  int limiting_contact() const;
  /// Largest horizontal distance of two contacts in the nominal posture, m.
  double span_m() const;
  /// Centre of mass in the nominal posture, in plan, relative to the trunk.
  const Eigen::Vector2d& com() const { return com_; }

  /// A contact and the place where it stands.
  struct Placement {
    int contact = 0;           ///< index of the contact
    Eigen::Vector3d position;  ///< point on the ground, m
  };
  /// Returns the pose of the trunk over contacts at which they are closest to their nominal places (least squares).
  /// `yaw_hint_rad`: heading if there is a single contact.
  TrunkPose Fit(std::span<const Placement> placements, double yaw_hint_rad) const;
  /// Returns true if, from a trunk above `pose` at one of several heights, level or parallel to the plane through the
  /// contacts, all contacts are in reach.
  bool ReachesAll(std::span<const Placement> placements, const TrunkPose& pose) const;

 private:
  /// Reach of one leg, with its cells of reach: a cell is true if a sample is within one ball's radius of its centre.
  struct Leg {
    std::vector<ReachSample> samples;
    ReachSample nominal;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    Eigen::Vector3i cells = Eigen::Vector3i::Zero();
    double cell_m = 1.0;
    std::vector<bool> reached;
  };

  static std::size_t Index(int contact) { return static_cast<std::size_t>(contact); }
  static void FillCells(Leg& leg);
  void SampleLeg(const Dataset& dataset, int contact, std::uint64_t seed);
  void ChooseHeight();
  double StrideOf(int contact, double height_m) const;
  double StrideAt(double height_m) const;

  std::vector<Leg> legs_;
  double height_m_ = 0.0;
  double stride_m_ = 0.0;
  Eigen::Vector2d com_ = Eigen::Vector2d::Zero();
};

}  // namespace legopt::worldgen
