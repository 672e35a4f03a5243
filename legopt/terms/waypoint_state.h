#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "legopt/collision/collision_query.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// What the terms of one waypoint share at one configuration: kinematics, and contacts computed at their first use.
/// A workspace; the query may be shared by the waypoints of one program (one thread).
class WaypointState {
 public:
  /// `query`: of the robot's collision model; both must outlive the state. `contact_range_m` > 0: pairs closer than
  /// this are contacts().
  WaypointState(const RobotModel& robot, CollisionQuery& query, double contact_range_m)
      : configuration_(Eigen::VectorXd::Constant(robot.configuration_size(), std::numeric_limits<double>::quiet_NaN())),
        kinematics_(robot),
        query_(&query),
        contact_range_m_(contact_range_m) {}

  /// Nothing happens when the waypoint is there already.
  void Update(Eigen::Ref<const Eigen::VectorXd> x) {
    if (x == configuration_) return;
    configuration_ = x;
    kinematics_.Update(x);
    contacts_valid_ = false;
    ++revision_;
  }

  /// Forgets what earlier configurations have left behind to make queries faster: all that is computed from here on
  /// hangs on what comes.
  void Forget() {
    memory_.Clear();
    contacts_valid_ = false;
    ++revision_;
  }

  /// n + 7 numbers; not numbers before the first Update().
  const Eigen::VectorXd& configuration() const { return configuration_; }
  /// Grows with every change of the configuration: what was computed at an equal revision still holds.
  std::uint64_t revision() const { return revision_; }
  /// At configuration().
  const Kinematics& kinematics() const { return kinematics_; }
  double contact_range_m() const { return contact_range_m_; }  ///< as given at construction
  /// For further queries near the waypoint.
  ContactMemory& memory() { return memory_; }

  /// Pairs closer than the contact range, in the query's order. But for rounding, and which of equally near points they
  /// have, they hang on the configuration alone.
  const std::vector<Contact>& contacts() {
    if (!contacts_valid_) {
      const std::span<const Contact> found = query_->Contacts(kinematics_, contact_range_m_, &memory_);
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
  ContactMemory memory_;  ///< one configuration follows another one nearby
  bool contacts_valid_ = false;
  std::vector<Contact> contacts_;
};

}  // namespace legopt
