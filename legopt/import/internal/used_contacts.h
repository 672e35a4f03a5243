#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/internal/terrain.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/types/task.h"

namespace legopt {

/// Problem ids by task.
using ProblemIds = std::map<Task, std::set<int>>;

/// Formats problem ids like "posture 3, 33, 38-39; motion 0-4".
std::string ToString(const ProblemIds& ids);

/// A target contact and the problems that use it.
struct UsedContact {
  ContactTarget target;
  ProblemIds problems;  ///< problems with a stance that contains it
};

/// Collects the different target contacts of problems, in the order of their first use.
class UsedContactList {
 public:
  /// Adds the contacts of the problems of one task.
  void Add(Task task, std::span<const ProblemDefinition> problems);
  /// Different contacts in the order of first use.
  const std::vector<UsedContact>& all() const { return contacts_; }

 private:
  std::vector<UsedContact> contacts_;
  std::map<std::string, size_t> index_;  ///< keyed by the contact's text
};

/// The surface above or below a position.
struct Ground {
  double gap_m = 0.0;  ///< distance from the surface along its normal; > 0: the position is above
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< point of the surface
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, up
  bool found = false;                                 ///< false: no surface is near, and the other members are
                                                      ///< undefined
};

/// Returns the upward surface nearest to the position, at most 0.3 m above or below.
Ground FindGround(const Terrain& terrain, const Eigen::Vector3d& position);

/// Evidence for the order of the quaternions in a problem file: the number of contacts that agree with the ground under
/// each order. A contact agrees if its z axis is within 5 degrees of the surface normal at its position or, without a
/// surface within 0.3 m, within 45 degrees of the vertical.
struct QuaternionEvidence {
  int contacts = 0;       ///< number of contacts checked
  int agree_w_first = 0;  ///< number that agree if read as w x y z
  int agree_x_first = 0;  ///< number that agree if read as x y z w

  /// Conclusion from the evidence.
  enum class Verdict {
    kWFirst,  ///< w x y z
    kXFirst,  ///< x y z w
    kEither,  ///< equal evidence for both
    kNeither  ///< less than half agree with either order
  };
  /// Order with more agreeing contacts; kEither on a tie (feet rotated by 0 or 180 degrees only), kNeither if less than
  /// half agree with either.
  Verdict verdict() const;
  std::string Describe() const;  ///< text like "w first: 70 of 70 normals agree, x first: 3"
};

/// Compares every contact with the ground under both orders; `contacts` have been read as w x y z.
QuaternionEvidence CollectQuaternionEvidence(std::span<const UsedContact> contacts, const Terrain& terrain);

/// Returns the finding for files that are read as w x y z, the format's order.
DatasetDiagnostic DiagnoseQuaternionOrder(const QuaternionEvidence& evidence);

/// Returns the rotation of a pose whose numbers are x y z w, but were read as w x y z.
Eigen::Quaterniond ReadAsXFirst(const Eigen::Quaterniond& read_as_w_first);

}  // namespace legopt
