#pragma once

#include <cstdint>
#include <optional>

#include "app/command_line.h"
#include "client/report/result_filter.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Choice of one job of an experiment by its method, task, initialization and problem instead of its number.
struct JobChoice {
  std::optional<std::int64_t> experiment;  ///< default: the newest
  ResultFilter filter;
  std::optional<int> problem;
};

/// Adds --experiment and the options of AddResultFilterOptions. `choice` must outlive parsing.
void AddJobChoiceOptions(const app::Command& command, JobChoice* choice);

/// Returns the job. Throws the errors of FindExperiment and KeptCells, and ClientError (kUsage) unless the choice is
/// one job; the error names the jobs if there are several.
std::int64_t ChooseJob(ResultSource& source, const JobChoice& choice);

}  // namespace legopt::client
