#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/internal/term_weights.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// State that the terms of one waypoint share at one configuration: kinematics, and contacts, which are computed at
/// their first use. A workspace; the query may be shared by the waypoints of one program (one thread).
class WaypointState {
 public:
  /// `query` must use the robot's collision model; both must outlive the state. `contact_range_m` > 0: contacts() are
  /// the pairs closer than this.
  WaypointState(const RobotModel& robot, CollisionQuery& query, double contact_range_m)
      : configuration_(Eigen::VectorXd::Constant(robot.configuration_size(), std::numeric_limits<double>::quiet_NaN())),
        kinematics_(robot),
        query_(&query),
        contact_range_m_(contact_range_m) {}

  /// Moves to configuration x. Does nothing if the waypoint is already there.
  void Update(Eigen::Ref<const Eigen::VectorXd> x) {
    if (x == configuration_) return;
    configuration_ = x;
    kinematics_.Update(x);
    contacts_valid_ = false;
    ++revision_;
  }

  /// Clears caches by which earlier configurations make queries faster, so that later results do not depend on them.
  void ClearCache() {
    memory_.Clear();
    contacts_valid_ = false;
    ++revision_;
  }

  /// n + 7 numbers; NaN before the first Update().
  const Eigen::VectorXd& configuration() const { return configuration_; }
  /// Increases with every change of the configuration: results computed at an equal revision are still valid.
  std::uint64_t revision() const { return revision_; }
  /// Kinematics at configuration().
  const Kinematics& kinematics() const { return kinematics_; }
  double contact_range_m() const { return contact_range_m_; }
  /// Memory for further queries near the waypoint.
  WarmStartCache& memory() { return memory_; }

  /// Pairs closer than the contact range, in the query's order. They depend on the configuration only, except for
  /// rounding and the choice among equally near points.
  const std::vector<ProximityPair>& contacts() {
    if (!contacts_valid_) {
      const std::span<const ProximityPair> found = query_->Contacts(kinematics_, contact_range_m_, &memory_);
      contacts_.assign(found.begin(), found.end());
      contacts_valid_ = true;
    }
    return contacts_;
  }

 private:
  Eigen::VectorXd configuration_;
  std::uint64_t revision_ = 0;
  Kinematics kinematics_;
  CollisionQuery* query_;
  double contact_range_m_;
  WarmStartCache memory_;  ///< speeds up queries at successive nearby configurations
  bool contacts_valid_ = false;
  std::vector<ProximityPair> contacts_;
};

// The terms of one waypoint. Each refers to the state of its waypoint, which must outlive it.

/// Cost: static torques in units of gravity, r = tau / g over all joints, base fixed in space. N m per m/s^2, which is
/// kg m (docs/explanation/paper.md#torque-cost).
class TorqueCostTerm : public Term {
 public:
  /// `state` is that of `waypoint` in its program.
  TorqueCostTerm(int waypoint, WaypointState& state);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kTorqueCost_ns; }

 private:
  WaypointState* state_;
  Eigen::VectorXd torque_;
  Eigen::MatrixXd jacobian_;
};

/// Equality: a foot's link frame at its target. With E = target^-1 * actual, the vector part of E's unit quaternion
/// (scalar part >= 0) and E's translation in m: exactly the six numbers that the judge checks
/// (docs/explanation/judge.md#foot-pose-error).
class ContactPoseTerm : public Term {
 public:
  /// Weight with a relaxed margin: a solver tolerance of 4e-4 then allows 9.5e-4 of the judge's 1e-3.
  static constexpr double kRelaxedWeight = 0.42;

  /// Weights of the six numbers, in (0, 1].
  struct Weights {
    double kept = 1.0;              ///< weight with the whole margin
    double spent = kRelaxedWeight;  ///< weight with any part of the margin relaxed
  };

  /// `target`: pose of the foot's link frame in the world. `name`: name of the foot, for messages.
  ContactPoseTerm(int waypoint, WaypointState& state, int link, const Eigen::Isometry3d& target,
                  const std::string& name, const Weights& weights);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// Relaxes the whole margin if `share` > 0: the judge checks the same numbers, so keeping a part of it has no use.
  bool RelaxMargin(double share) override {
    weight_ = share > 0.0 ? weights_.spent : weights_.kept;
    return weights_.spent != weights_.kept;
  }

  std::int64_t weight_ns() const override { return term_weights::kContactPose_ns; }

 private:
  /// Returns the error vector and sets `rotation` to E's quaternion.
  Eigen::Matrix<double, 6, 1> Error(Eigen::Quaterniond& rotation) const;

  WaypointState* state_;
  int link_;
  Eigen::Isometry3d target_;
  Weights weights_;
  double weight_;  ///< current weight
  Eigen::MatrixXd point_jacobian_, angular_jacobian_;
};

/// Equality: the origin of a point contact's frame at its target, in the axes of the target, m: the three numbers that
/// the judge checks. The link may turn about it.
class ContactPointTerm : public Term {
 public:
  /// `target` must be that of `contact`, which must outlive the term. Its margin is never relaxed, because the judge's
  /// 1 mm for the gap (kPointTouchTolerance_m) leaves none.
  ContactPointTerm(int waypoint, WaypointState& state, const Contact& contact, const ContactTarget& target);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kContactPoint_ns; }

 private:
  /// Returns the position of the contact frame's origin in the world.
  Eigen::Vector3d Origin() const;

  WaypointState* state_;
  const Contact* contact_;
  Eigen::Vector3d target_W_;
  Eigen::Matrix3d axes_;  ///< rows: axes of the target in the world
  Eigen::MatrixXd jacobian_;
};

/// Equality: the origin of a contact frame at its target, and one axis of the frame parallel to the target's, with any
/// turn about it: the normal of a palm, the bar of a rail. Rows: the vector part of the smallest rotation from the
/// target's axis to the frame's, without its component about the axis, which is 0; then the origin, m; all in the axes
/// of the target, as the judge checks them (docs/explanation/judge.md#foot-pose-error).
class ContactAxisTerm : public Term {
 public:
  /// `contact` has a free axis and must outlive the term. `slide_m` > 0: the origin may move along the x axis, which
  /// ContactSlideTerm bounds.
  ContactAxisTerm(int waypoint, WaypointState& state, const Contact& contact, const ContactTarget& target,
                  double slide_m);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kContactPose_ns; }

 private:
  /// Axis of the contact frame and origin's error, in the axes of the target.
  struct Error {
    Eigen::Vector3d axis;
    Eigen::Vector3d origin;
  };
  Error Measure() const;

  WaypointState* state_;
  const Contact* contact_;
  int axis_;          ///< column of the frame: 0 or 2
  int first_origin_;  ///< first constrained component of the origin: 0, or 1 if it slides along x
  Eigen::Vector3d target_W_;
  Eigen::Matrix3d axes_;  ///< rows: axes of the target in the world
  Eigen::MatrixXd point_jacobian_, angular_jacobian_;
};

/// Inequality: |s| <= slide_m for the distance s, m, of a grip from its target along the bar. Two rows.
class ContactSlideTerm : public Term {
 public:
  /// `contact` must outlive the term.
  ContactSlideTerm(int waypoint, WaypointState& state, const Contact& contact, const ContactTarget& target,
                   double slide_m);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kContactSlide_ns; }

 private:
  double Distance() const;

  WaypointState* state_;
  const Contact* contact_;
  double slide_m_;
  Eigen::Vector3d target_W_, bar_W_;
};

/// Inequality: the centre of mass inside a polygon, one row a.c + b <= 0 per edge, m.
class ComTerm : public Term {
 public:
  /// `edges`: half-planes in the world's xy plane, such as those of the support polygon of the waypoint's targets.
  /// `weight`: 0 for an inequality; > 0: a preference of this weight, per metre.
  ComTerm(int waypoint, WaypointState& state, std::vector<HalfPlane> edges, double weight = 0.0);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

  std::int64_t weight_ns() const override { return term_weights::kCom_ns; }

 private:
  WaypointState* state_;
  std::vector<HalfPlane> edges_;
  Eigen::MatrixXd jacobian_;
};

/// Inequality: margin - d <= 0 for every pair of shapes nearer than the contact range, m. Linearised with contact
/// points fixed in their links and a constant normal (collision_query.h; docs/explanation/paper.md#contacts).
class CollisionTerm : public Term {
 public:
  /// `margin_m`: distance to keep, at most the state's contact range. `relaxed_margin_m`: distance with the margin
  /// fully relaxed.
  CollisionTerm(int waypoint, WaypointState& state, double margin_m, double relaxed_margin_m);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// Appends the ids of the pairs of shapes.
  void RowKeys(int rows, std::vector<int>& keys) override;
  double AbsentRow() const override { return margin_m_ - state_->contact_range_m(); }
  bool RelaxMargin(double share) override {
    margin_m_ = full_margin_m_ + share * (relaxed_margin_m_ - full_margin_m_);
    return true;
  }
  bool SetDisabled(bool aside) override {
    disabled_ = aside;
    return true;
  }

  std::int64_t weight_ns() const override { return term_weights::kCollision_ns; }

 private:
  WaypointState* state_;
  double full_margin_m_, relaxed_margin_m_;
  double margin_m_;  ///< current margin
  bool disabled_ = false;
};

}  // namespace legopt
