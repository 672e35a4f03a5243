#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "legopt/geometry/collision_query.h"
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

}  // namespace legopt
