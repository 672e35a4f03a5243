#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/build_identity.h"
#include "client/client_error.h"
#include "client/report/listing.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// A check of `legopt service doctor` with its result.
struct DoctorDiagnostic {
  enum class State { kOk, kWarn, kFail };
  std::string check;  ///< e.g. "multicast route"
  State state = State::kOk;
  std::string detail;
  std::string fix;                ///< remedy; empty if the check passed
  ExitCode code = ExitCode::kOk;  ///< exit code of commands that would fail (kFail only)
};

struct DiagnosisOptions {
  NetworkOptions network;
  std::optional<std::string> dataset;
  std::optional<std::string> db;
  app::BuildFacts build;
};

/// Checks everything that a run depends on. Failed checks become findings, not exceptions.
std::vector<DoctorDiagnostic> Diagnose(const DiagnosisOptions& options);

/// Renders lines such as "ok    multicast route  through lo"; a failed check or warning is followed by its fix.
std::string RenderFindings(const std::vector<DoctorDiagnostic>& findings, TableFormat format, const TextLayout& layout);

/// Returns kOk if no check failed, else the code of the first failure. Warnings do not count.
ExitCode WorstOf(const std::vector<DoctorDiagnostic>& findings);

}  // namespace legopt::client
