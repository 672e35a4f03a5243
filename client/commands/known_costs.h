#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "words/task.h"

namespace legopt::client {

/// What one method of a spec is to do on one task, and what that has cost before.
struct KnownCost {
  std::string method_hash;
  Task task{};
  std::int64_t jobs = 0;
  std::optional<double> job_cpu_s;  ///< mean CPU time of a job with the same options; none: there is no result yet
  bool same_dataset = false;        ///< of results on the spec's dataset; else on others
};

/// For every method and task of a canonical spec, in its order. `source` may be null: nothing is known then.
std::vector<KnownCost> FindKnownCosts(const nlohmann::json& spec, ResultSource* source);

}  // namespace legopt::client
