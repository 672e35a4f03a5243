#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/waypoint_program.h"
#include "legopt/types/feasibility.h"

namespace legopt::certify {

/// A set of constraint groups; a value.
class ConstraintGroups {
 public:
  /// Set of `groups`; empty by default.
  constexpr ConstraintGroups(std::initializer_list<ConstraintGroup> groups = {}) {
    for (const ConstraintGroup group : groups) Add(group);
  }
  /// Adds a group.
  constexpr void Add(ConstraintGroup group) { bits_ |= Bit(group); }
  /// Returns whether the group is in the set.
  constexpr bool Has(ConstraintGroup group) const { return (bits_ & Bit(group)) != 0; }
  constexpr bool operator==(const ConstraintGroups&) const = default;

 private:
  static constexpr std::uint8_t Bit(ConstraintGroup group) {
    return static_cast<std::uint8_t>(1U << static_cast<unsigned>(group));
  }
  std::uint8_t bits_ = 0;
};

/// The constraints of one stance only, as a program of one waypoint without costs; some groups may be left out. Joint
/// limits and foot poses are always included.
///
/// A workspace; dataset and query (of the dataset's collision model) must outlive it. One thread.
class StanceProgram : public Program {
 public:
  /// `proximity` is the same as for WaypointProgram; continuous collision does not apply.
  StanceProgram(const Dataset& dataset, CollisionQuery& query, const Stance& stance, const ProximityOptions& proximity,
                ConstraintGroups left_out = {});

  int num_waypoints() const override { return 1; }
  int tangent_size() const override { return whole_.tangent_size(); }
  int point_size() const override { return whole_.point_size(); }
  /// Returns the terms that are not left out.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void ClearCache() override { whole_.ClearCache(); }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override { whole_.SetPoint(x); }
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override {
    whole_.Retract(x, dx, x_next);
  }
  void PullBack(const double* dx, double* row) const override { whole_.PullBack(dx, row); }
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override {
    whole_.StepBounds(x, lower, upper);
  }
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override { whole_.ProjectOnBounds(x); }

 private:
  WaypointProgram whole_;
  std::vector<std::unique_ptr<Term>> terms_;  ///< they refer to terms of whole_
};

}  // namespace legopt::certify
