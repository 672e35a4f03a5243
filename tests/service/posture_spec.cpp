#include "tests/service/posture_spec.h"

#include "client/suite/experiment_spec.h"
#include "legopt/dataset/dataset.h"
#include "legopt/solvers/methods/method.h"
#include "tests/folders.h"

namespace legopt::service {

std::filesystem::path DefaultDataset() { return std::filesystem::path(SourceFolder()) / "data" / "garage-small"; }

nlohmann::json PostureSpec(int repetitions) {
  Method method;
  method.multi_starts = 2;
  client::Suite suite;
  suite.name = "postures";
  suite.seed = 3;
  suite.repetitions = repetitions;
  suite.tasks = {{Task::kPosture, {}}};
  suite.methods = {method};
  nlohmann::json spec = client::BuildSpec(suite, client::FactsOf(*Dataset::Load(DefaultDataset())));
  spec["again"] = true;  // identical jobs must be solved and compared
  return spec;
}

}  // namespace legopt::service
