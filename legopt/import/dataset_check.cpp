#include "legopt/import/dataset_check.h"

#include <algorithm>
#include <utility>

#include "legopt/geometry/scene_solids.h"
#include "legopt/import/plausibility.h"
#include "legopt/import/quaternion_order.h"

namespace legopt {
namespace {

void Append(std::vector<DatasetDiagnostic> more, std::vector<DatasetDiagnostic>* findings) {
  std::move(more.begin(), more.end(), std::back_inserter(*findings));
}

UsedContactList UsedContactsOf(const Dataset& dataset) {
  UsedContactList contacts;
  for (const TaskDescription& task : ProblemTasks()) contacts.Add(task.task, dataset.problems(task.task));
  return contacts;
}

}  // namespace

std::vector<DatasetDiagnostic> CheckDataset(const Dataset& dataset) {
  std::vector<DatasetDiagnostic> findings = CheckRobot(dataset);
  Append(CheckPlausibility(dataset), &findings);
  Append(CheckSceneMeshes(dataset), &findings);
  Append(CheckMeshSizes(dataset), &findings);
  const UsedContactList contacts = UsedContactsOf(dataset);
  if (contacts.all().empty()) {
    findings.push_back({.severity = DatasetDiagnostic::Severity::kWarning,
                        .check = "problems",
                        .file = kDatasetFileName,
                        .field = "problems",
                        .value = "0",
                        .message = "the dataset poses no problems",
                        .fix = "'legopt generate problems --from DATASET --out NEW' makes some"});
    return findings;
  }
  if (AnyError(findings)) return findings;
  const Terrain terrain(CollectSceneTriangles(dataset.scene()));
  findings.push_back(DiagnoseQuaternionOrder(CollectQuaternionEvidence(contacts.all(), terrain)));
  if (findings.back().severity == DatasetDiagnostic::Severity::kError) return findings;
  Append(CheckContactHeights(dataset, contacts.all(), terrain), &findings);
  if (AnyError(findings)) return findings;
  Append(CheckSoles(dataset, contacts.all(), terrain), &findings);
  Append(CheckFootCollisions(dataset, contacts.all()), &findings);
  Append(CheckTrunk(dataset), &findings);
  return findings;
}

}  // namespace legopt
