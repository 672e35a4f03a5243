#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/program/program.h"
#include "legopt/robot/kinematics.h"
#include "legopt/terms/waypoint_state.h"

namespace legopt {

/// What a swept collision term looks at.
enum class Sweep : std::uint8_t {
  kWithScene,  ///< links against the scene, as in the paper
  kWithAll     ///< links against each other, too
};

/// Inequality or preference: no collision on the way from one waypoint to the next, margin - d <= 0, m (the paper's
/// continuous collision constraint; docs/readings.md#collision-between-waypoints). Robot links against the scene only,
/// as there, unless told otherwise.
///
/// Samples. The path (interpolation.h) is looked at where s = k / N, 0 < k < N; the ends belong to the collision terms
/// of their waypoints. Each link has its own number of sub-steps, the smallest power of two such that none of its
/// points moves more than `step_m` from one to the next, at most kMostSteps (longer ways then have longer steps), and
/// is looked at only there: a standing foot costs nothing. N is the largest of these numbers. A point's way is taken as
/// four times the longest of its ways within the quarters of the path, which is good to a few per cent. Powers of two
/// because the numbers jump as the waypoints move: they jump seldom, and a finer set contains the coarser one, so that
/// a jump up can only find more.
///
/// Rows. Of each pair of shapes only the nearest sample counts. It becomes a row when it violates the margin, or when
/// it is nearer than the pair is at both ends. So, between jumps of N, the penalty sum max(0, margin - d) is as
/// continuous as that of the ends (rows come and go with d >= margin, or where the query drops a repeat), while pairs
/// on which the ends already have the last word cost no row.
///
/// Derivatives are those of the nearest sample with s held, exact for the interpolated configuration: to first order
/// joints and base position move by (1 - s, s) times the ends' steps, the base turns by DifferentiateBaseTurn. Contact
/// points and normals as in CollisionTerm. Both ends always share a row, because 0 < s < 1: when one of them is fixed,
/// the other still has a gradient of at least 1 / N of the whole.
class SweptCollisionTerm : public Term {
 public:
  /// Longest way of a point of a link from one sample to the next, as far as kMostSteps allow, unless told otherwise.
  static constexpr double kStep_m = 0.1;
  /// Most sub-steps, a power of two.
  static constexpr int kMostSteps = 32;

  /// `from` and `to`: states of `waypoint` and `waypoint` + 1; `range_m` > margin_m: pairs nearer than this may become
  /// rows. `preference_weight`, per metre, makes it a preference; 0: an inequality. States, robot and query (of the
  /// states' collision model) must outlive the term. `step_m`: see above, > 0. By
  /// Sweep::kWithAll all links are looked at in all samples.
  SweptCollisionTerm(int waypoint, WaypointState& from, WaypointState& to, const RobotModel& robot,
                     CollisionQuery& query, double margin_m, double range_m, double preference_weight = 0.0,
                     double step_m = kStep_m, Sweep sweep = Sweep::kWithScene);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// The pairs of shapes: one row each.
  void RowKeys(int rows, std::vector<int>& keys) override;
  /// Pairs that are nearer and yet have no row keep the margin on the way and are nearer still at an end.
  double AbsentRow() const override { return margin_m_ - range_m_; }
  bool SetAside(bool aside) override {
    aside_ = aside;
    return true;
  }

  /// One row: the nearest sample of a pair of shapes.
  struct Row {
    Contact contact;  ///< as at that sample
    double s = 0;     ///< where on the path, in (0, 1)
  };
  /// Rows at the states' present configurations, ascending by s, then in the query's order.
  std::span<const Row> rows();
  /// Sub-steps of a link at the states' present configurations: 1 = not looked at.
  int num_steps(int link);

 private:
  void Refresh();
  int ChooseSteps();
  void MeasureWays();
  void LengthenWays(const Kinematics& before, const Kinematics& after);
  void CollectRows(int most_steps);
  /// At sample k of `most_steps`.
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
  bool aside_ = false;

  std::uint64_t from_revision_ = 0;  ///< of the rows; 0 is never that of a state in use
  std::uint64_t to_revision_ = 0;
  std::array<Kinematics, 3> quarters_;  ///< at s = 1/4, 1/2, 3/4
  Kinematics kinematics_;               ///< anywhere on the path
  Eigen::VectorXd x_;
  Eigen::VectorXd gradient_;
  std::vector<double> ways_;  ///< by link: the longest within a quarter of the path, m
  std::vector<int> steps_;    ///< by link
  std::vector<int> links_;    ///< looked at in one sample
  std::vector<Row> rows_;
};

}  // namespace legopt
