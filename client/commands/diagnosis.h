#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/client_error.h"
#include "client/report/listing.h"
#include "client/service/server_connection.h"
#include "programs/build_identity.h"

namespace legopt::client {

/// One line of `legopt doctor`.
struct Finding {
  enum class State { kOk, kWarn, kFail };
  std::string check;  ///< e.g. "multicast route"
  State state = State::kOk;
  std::string detail;             ///< what was found
  std::string fix;                ///< what to do; empty when all is well
  ExitCode code = ExitCode::kOk;  ///< for kFail: what a command would exit with
};

struct DiagnosisOptions {
  NetworkOptions network;
  std::optional<std::string> dataset;
  std::optional<std::string> db;
  programs::BuildFacts build;  ///< of this program
};

/// Looks at everything a run depends on. Never throws for what it finds; each fault becomes a finding.
std::vector<Finding> Diagnose(const DiagnosisOptions& options);

/// "ok    multicast route  through lo" lines; a finding that is not ok is followed by its fix.
std::string RenderFindings(const std::vector<Finding>& findings, ListingFormat format, const TextLayout& layout);

/// kOk when nothing failed, else the code of the first failure. Warnings do not count.
ExitCode WorstOf(const std::vector<Finding>& findings);

}  // namespace legopt::client
