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

FootholdList FootholdsOf(const Dataset& dataset) {
  FootholdList footholds;
  for (const TaskDescription& task : ProblemTasks()) footholds.Add(task.task, dataset.problems(task.task));
  return footholds;
}

}  // namespace

std::vector<DatasetDiagnostic> CheckDataset(const Dataset& dataset) {
  std::vector<DatasetDiagnostic> findings = CheckRobot(dataset);
  Append(CheckPlausibility(dataset), &findings);
  Append(CheckSceneMeshes(dataset), &findings);
  Append(CheckMeshSizes(dataset), &findings);
  const FootholdList footholds = FootholdsOf(dataset);
  if (footholds.all().empty()) {
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
  findings.push_back(DiagnoseQuaternionOrder(CollectQuaternionEvidence(footholds.all(), terrain)));
  if (findings.back().severity == DatasetDiagnostic::Severity::kError) return findings;
  Append(CheckFootholdHeights(dataset, footholds.all(), terrain), &findings);
  if (AnyError(findings)) return findings;
  Append(CheckSoles(dataset, footholds.all(), terrain), &findings);
  Append(CheckFootCollisions(dataset, footholds.all()), &findings);
  Append(CheckTrunk(dataset), &findings);
  return findings;
}

}  // namespace legopt
