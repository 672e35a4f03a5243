#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "programs/command_line.h"
#include "words/collision.h"

namespace legopt::client {

/// Which methods of an experiment a command is about; an empty field keeps all.
struct MethodFilter {
  std::optional<std::string> method;  ///< name, whatever its letter case
  std::optional<std::int64_t> multi_starts;
  std::optional<std::int64_t> sample_size;  ///< percent
  std::optional<SceneRepresentation> collision;
};

/// --method, --multi-starts, --sample-size, --collision. `filter` must outlive the parse.
void AddMethodFilterOptions(const programs::Command& command, MethodFilter* filter);

/// --collision alone.
void AddCollisionOption(const programs::Command& command, std::optional<SceneRepresentation>* collision);

/// The methods of one experiment, and what tells them apart.
class ExperimentMethods {
 public:
  ExperimentMethods(ResultSource& source, std::int64_t experiment_id);

  /// SQL for "cell_id is of a method that the filter keeps", e.g. "method_id IN (1, 4)"; empty when it keeps all.
  /// Throws ClientError (kUsage), naming the nearest or the known values, when it keeps none.
  std::string Condition(const MethodFilter& filter) const;

  /// Of the columns multi_starts, sample_size, incremental and collision those in which two methods of one name differ.
  std::vector<std::string> TellingColumns() const;

 private:
  Listing methods_;
  std::int64_t experiment_id_;
};

}  // namespace legopt::client
