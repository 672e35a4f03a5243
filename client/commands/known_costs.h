#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// The jobs of one method of a spec on one task, and their cost in earlier results.
struct KnownCost {
  std::string method_hash;
  Task task{};
  std::int64_t jobs = 0;
  std::optional<double> job_cpu_s;  ///< mean CPU time of a job with the same options; nullopt without results
  bool same_dataset = false;        ///< results are on the spec's dataset; false: on others
};

/// Returns an element for every method and task of a canonical spec, in its order. `source` may be nullptr: then no
/// costs are known.
std::vector<KnownCost> FindKnownCosts(const nlohmann::json& spec, ResultSource* source);

}  // namespace legopt::client
