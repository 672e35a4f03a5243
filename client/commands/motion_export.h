#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/report/motion_files.h"
#include "client/report/result_filter.h"
#include "legopt/dataset/dataset.h"
#include "legopt/judge/solution_file.h"

namespace legopt::client {

/// Arguments of `legopt export --motion`.
struct MotionExport {
  static constexpr double kDefaultRate_Hz = 100.0;

  std::optional<MotionFormat> format;  ///< nullopt: solutions are exported, and the rest is not used
  std::optional<std::string> file;     ///< solution file; nullopt: an experiment
  std::optional<int> problem;
  double rate_Hz = kDefaultRate_Hz;
};

/// Adds --motion, --file, --problem and --rate. `options` must outlive parsing.
void AddMotionExportOptions(const app::Command& command, MotionExport* options);

/// Samples the only motion of `files` that `options` choose and returns its text. `source` names the files in errors,
/// e.g. "experiment 3". Throws ClientError: kUsage unless exactly one motion matches, kJobsFailed if it cannot be
/// executed; and the errors of DefinitionOf.
std::string ExportedMotion(const MotionExport& options, const std::vector<SolutionFile>& files, const Dataset& dataset,
                           const std::string& source);

}  // namespace legopt::client
