#include "legopt/import/internal/used_contacts.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "legopt/import/internal/degree.h"

namespace legopt {

std::string ToString(const ProblemIds& ids) {
  std::string text;
  for (const auto& [task, set] : ids) {
    if (set.empty()) continue;
    text += (text.empty() ? "" : "; ") + std::string(ToString(task));
    const char* separator = " ";
    for (auto id = set.begin(); id != set.end();) {
      const int first = *id;
      int last = first;
      for (++id; id != set.end() && *id == last + 1; ++id) last = *id;
      text += separator + std::to_string(first);
      if (last > first) text += "-" + std::to_string(last);
      separator = ", ";
    }
  }
  return text;
}

void UsedContactList::Add(Task task, std::span<const ProblemDefinition> problems) {
  for (const ProblemDefinition& problem : problems) {
    for (const Stance& stance : problem.stances) {
      for (const ContactTarget& target : stance.contacts) {
        const auto [place, fresh] = index_.try_emplace(FormatStance({{target}}), contacts_.size());
        if (fresh) contacts_.push_back({target, {}});
        contacts_[place->second].problems[task].insert(problem.id);
      }
    }
  }
}

Ground FindGround(const Terrain& terrain, const Eigen::Vector3d& position) {
  constexpr double kRange_m = 0.3;
  std::vector<Terrain::Hit> hits;
  terrain.Ground(position.x(), position.y(), position.z() - kRange_m, position.z() + kRange_m, hits);
  Ground ground;
  for (const Terrain::Hit& hit : hits) {
    const Eigen::Vector3d& normal = terrain.normal(hit.triangle);
    const double gap_m = (position.z() - hit.z_m) * normal.z();
    if (ground.found && std::abs(gap_m) >= std::abs(ground.gap_m)) continue;
    ground = {.gap_m = gap_m, .point = {position.x(), position.y(), hit.z_m}, .normal = normal, .found = true};
  }
  return ground;
}

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
