#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "legopt/geometry/collision_query.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/internal/term_weights.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Computes the difference of two configurations (n + 7 each) in n + 6 numbers: joints, base position (m), and 2 e,
/// where e is the vector part of the shorter unit quaternion of R_to R_from^T. 2 e is the rotation vector in world
/// axes, up to the third order.
void ConfigurationDifference(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                             Eigen::Ref<Eigen::VectorXd> difference);

/// Cost of a transition: squared change from one waypoint to the next, joints and base with weight 1 (the judge counts
/// joints only). All transitions of a program form one sampling unit (docs/explanation/paper.md#terms-and-samples).
class VelocityCostTerm : public Term {
 public:
  /// The states are those of `waypoint` and its successor and must outlive the term.
  VelocityCostTerm(int waypoint, int unit, const WaypointState& from, const WaypointState& to);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kVelocityCost_ns; }

 private:
  const WaypointState* from_;
  const WaypointState* to_;
  Eigen::VectorXd difference_;
};

/// Pairs that a swept collision term checks.
enum class Sweep : std::uint8_t {
  kWithScene,  ///< links against the scene, as in the paper
  kWithAll     ///< links against the scene and against each other
};

/// Inequality or preference: no collision between one waypoint and the next, margin - d <= 0, m (the paper's continuous
/// collision constraint; docs/explanation/paper.md#collision-between-waypoints). By default, as in the paper, only
/// robot links against the scene.
///
/// Samples. The path (interpolation.h) is checked at s = k / N, 0 < k < N; the ends belong to the collision terms of
/// their waypoints. Each link has its own number of sub-steps: the smallest power of two with which none of its points
/// moves more than `step_m` per sub-step, at most kMaxSteps (longer paths then have longer sub-steps). A link is
/// checked only at the ends of its sub-steps, so a standing foot costs nothing. N is the largest of these numbers. The
/// length of a point's path is estimated as four times the largest displacement within the quarters of the path, which
/// is accurate to a few per cent. The numbers jump as the waypoints move. Powers of two jump rarely, and a finer set of
/// samples contains the coarser one, so that a jump up can only find more.
///
/// Rows. Only the nearest sample of each pair of shapes counts. It becomes a row if it violates the margin, or if it is
/// nearer than the pair is at both ends. Between jumps of N, the penalty sum max(0, margin - d) is therefore as
/// continuous as that of the ends (rows appear and disappear with d >= margin, or where the query drops a duplicate).
/// Pairs that are nearest at an end add no row.
///
/// Derivatives are those of the nearest sample with constant s, exact for the interpolated configuration. To first
/// order, joints and base position move by (1 - s, s) times the ends' steps, and the base rotates by
/// DifferentiateBaseRotation. Contact points and normals are treated as in CollisionTerm. Both ends always share a row,
/// because 0 < s < 1: if one of them is fixed, the other still has a gradient of at least 1 / N of the whole.
class SweptCollisionTerm : public Term {
 public:
  /// Default of `step_m`: longest displacement of a link's point between two samples, unless kMaxSteps is reached.
  static constexpr double kStep_m = 0.1;
  /// Maximum number of sub-steps, a power of two.
  static constexpr int kMaxSteps = 32;

  /// `from` and `to`: states of `waypoint` and `waypoint` + 1. `range_m` > margin_m: pairs nearer than this may become
  /// rows. `preference_weight`, per metre, makes the term a preference; 0: an inequality. `step_m`: see above, > 0.
  /// With Sweep::kWithAll, all links are checked in all samples. States, robot and query (of the states' collision
  /// model) must outlive the term.
  SweptCollisionTerm(int waypoint, WaypointState& from, WaypointState& to, const RobotModel& robot,
                     CollisionQuery& query, double margin_m, double range_m, double preference_weight = 0.0,
                     double step_m = kStep_m, Sweep sweep = Sweep::kWithScene);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// Appends the ids of the pairs of shapes, one per row.
  void RowKeys(int rows, std::vector<int>& keys) override;
  /// Pairs within range that have no row keep the margin on the path and are nearer at an end.
  double AbsentRow() const override { return margin_m_ - range_m_; }
  bool SetDisabled(bool aside) override {
    disabled_ = aside;
    return true;
  }

  /// One row: the nearest sample of a pair of shapes.
  struct Row {
    ProximityPair contact;  ///< contact at that sample
    double s = 0;           ///< position on the path, in (0, 1)
  };
  /// Returns the rows at the states' current configurations, ascending by s, then in the query's order.
  std::span<const Row> rows();
  /// Returns the number of sub-steps of a link at the states' current configurations; 1: not checked.
  int num_steps(int link);

  std::int64_t weight_ns() const override { return term_weights::kSweptCollision_ns; }

 private:
  void Refresh();
  int ChooseSteps();
  void MeasureDisplacements();
  void UpdateDisplacements(const Kinematics& before, const Kinematics& after);
  void CollectRows(int most_steps);
  /// Returns the kinematics at sample k of `most_steps`.
  const Kinematics& PlaceSample(int k, int most_steps);
  void KeepNearestSamples();
  bool Matters(const Row& row);

  WaypointState* from_;
  WaypointState* to_;
  const RobotModel* robot_;
  CollisionQuery* query_;
  double margin_m_;
  double range_m_;
  double step_m_;
  Sweep sweep_;
  bool disabled_ = false;

  std::uint64_t from_revision_ = 0;  ///< state revision for which rows_ are valid; 0: none
  std::uint64_t to_revision_ = 0;
  std::array<Kinematics, 3> quarters_;  ///< kinematics at s = 1/4, 1/2, 3/4
  Kinematics kinematics_;               ///< kinematics at any other sample
  Eigen::VectorXd x_;
  Eigen::VectorXd gradient_;
  std::vector<double> displacements_;  ///< largest displacement of each link within a quarter of the path, m
  std::vector<int> steps_;             ///< number of sub-steps of each link
  std::vector<int> links_;             ///< links that are checked in one sample
  std::vector<Row> rows_;
};

}  // namespace legopt
