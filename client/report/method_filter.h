#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "client/report/result_source.h"
#include "legopt/types/collision.h"

namespace legopt::client {

/// Filter for the methods of an experiment; an empty field keeps all.
struct MethodFilter {
  std::optional<std::string> method;  ///< name, ignoring case
  std::optional<std::int64_t> multi_starts;
  std::optional<std::int64_t> sample_size;  ///< percent
  std::optional<SceneRepresentation> collision;
};

/// Adds --method, --multi-starts, --sample-size, --collision. `filter` must outlive parsing.
void AddMethodFilterOptions(const app::Command& command, MethodFilter* filter);

/// Adds only --collision.
void AddCollisionOption(const app::Command& command, std::optional<SceneRepresentation>* collision);

/// The methods of an experiment and their distinguishing properties.
class ExperimentMethods {
 public:
  ExperimentMethods(ResultSource& source, std::int64_t experiment_id);

  /// Returns the ids of the kept methods; empty if the filter is empty. Throws ClientError (kUsage) with the most
  /// similar or the known values if it keeps none.
  std::vector<std::int64_t> Ids(const MethodFilter& filter) const;

  /// Those of the columns multi_starts, sample_size, incremental and collision in which methods of the same name
  /// differ.
  std::vector<std::string> DistinguishingColumns() const;

 private:
  Listing methods_;
  std::int64_t experiment_id_;
};

}  // namespace legopt::client
