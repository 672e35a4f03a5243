#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/commands/options.h"
#include "client/report/result_filter.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Options of `legopt show`.
struct ShowOptions {
  std::int64_t job = 0;  ///< the job, also if `choice` chose it
  std::optional<std::int64_t> named;
  JobChoice choice;
  bool logs = false;
  bool trace = false;
  std::optional<std::string> out;  ///< file for the trace
  SourceOptions source;
  ListingOptions listing;
};

/// Prints the attempts of the job with causes, signals and logs. Throws ClientError (kUsage) for an unknown job.
ExitCode ShowLogs(const ShowOptions& options);

/// Prints how the solve of the job converged, or writes it to `out`. Throws the errors of ReadTrace.
ExitCode ShowTrace(const ShowOptions& options);

}  // namespace legopt::client
