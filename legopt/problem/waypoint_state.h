#pragma once

#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// What the terms of one waypoint share at one configuration: kinematics, and contacts computed at their first use.
/// A workspace; the query may be shared by the waypoints of one program (one thread).
class WaypointState {
 public:
  WaypointState(const RobotModel& robot, CollisionQuery& query, double contact_range_m)
      : kinematics_(robot), query_(&query), contact_range_m_(contact_range_m) {}

  void Update(Eigen::Ref<const Eigen::VectorXd> x) {
    configuration_ = x;
    kinematics_.Update(x);
    contacts_valid_ = false;
  }

  /// n + 7 numbers.
  const Eigen::VectorXd& configuration() const { return configuration_; }
  const Kinematics& kinematics() const { return kinematics_; }

  /// Pairs closer than the contact range, in the query's order.
  const std::vector<Contact>& contacts() {
    if (!contacts_valid_) {
      const std::span<const Contact> found = query_->Contacts(kinematics_, contact_range_m_);
      contacts_.assign(found.begin(), found.end());
      contacts_valid_ = true;
    }
    return contacts_;
  }

 private:
  Eigen::VectorXd configuration_;
  Kinematics kinematics_;
  CollisionQuery* query_;
  double contact_range_m_;
  bool contacts_valid_ = false;
  std::vector<Contact> contacts_;
};

}  // namespace legopt
