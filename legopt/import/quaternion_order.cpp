#include "legopt/import/quaternion_order.h"

#include <algorithm>
#include <cmath>

#include "legopt/import/degree.h"
#include "legopt/import/ground.h"

namespace legopt {
namespace {

bool Agrees(const Eigen::Quaterniond& rotation, const Ground& ground) {
  const double least = std::cos((ground.found ? 5.0 : 45.0) * kDegree);
  return (rotation * Eigen::Vector3d::UnitZ()).dot(ground.normal) >= least;
}

}  // namespace

Eigen::Quaterniond ReadAsXFirst(const Eigen::Quaterniond& read_as_w_first) {
  const Eigen::Quaterniond& q = read_as_w_first;
  return {q.z(), q.w(), q.x(), q.y()};
}

QuaternionEvidence CollectQuaternionEvidence(std::span<const UsedContact> contacts, const Terrain& terrain) {
  QuaternionEvidence evidence;
  for (const UsedContact& used : contacts) {
    const Ground ground = FindGround(terrain, used.target.position);
    ++evidence.contacts;
    evidence.agree_w_first += Agrees(used.target.rotation, ground) ? 1 : 0;
    evidence.agree_x_first += Agrees(ReadAsXFirst(used.target.rotation), ground) ? 1 : 0;
  }
  return evidence;
}

QuaternionEvidence::Verdict QuaternionEvidence::verdict() const {
  if (2 * std::max(agree_w_first, agree_x_first) < contacts) return Verdict::kNeither;
  if (agree_w_first == agree_x_first) return Verdict::kEither;
  return agree_w_first > agree_x_first ? Verdict::kWFirst : Verdict::kXFirst;
}

std::string QuaternionEvidence::Describe() const {
  return "w first: " + std::to_string(agree_w_first) + " of " + std::to_string(contacts) +
         " normals agree, x first: " + std::to_string(agree_x_first);
}

DatasetDiagnostic DiagnoseQuaternionOrder(const QuaternionEvidence& evidence) {
  using Severity = DatasetDiagnostic::Severity;
  DatasetDiagnostic finding{.severity = Severity::kInfo,
                            .check = "quaternion order",
                            .file = "",
                            .field = "definition",
                            .value = evidence.Describe(),
                            .message = "",
                            .fix = ""};
  switch (evidence.verdict()) {
    case QuaternionEvidence::Verdict::kWFirst:
      finding.message = "quaternions are w x y z, as they should be";
      break;
    case QuaternionEvidence::Verdict::kEither:
      finding.message = "both orders fit these poses; taken as w x y z, the order of the format";
      break;
    case QuaternionEvidence::Verdict::kXFirst:
      finding.severity = Severity::kError;
      finding.message = "quaternions are x y z w";
      finding.fix = "'legopt import' turns them into w x y z";
      break;
    case QuaternionEvidence::Verdict::kNeither:
      finding.severity = Severity::kError;
      finding.message = "in neither order are the feet on the surface: the poses do not belong to this scene";
      finding.fix = "check scene, unit of length and frame; a pose is qw qx qy qz px py pz, z axis along the normal";
      break;
  }
  return finding;
}

}  // namespace legopt
