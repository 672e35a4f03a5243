#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "client/report/text_layout.h"
#include "legopt/import/dataset_diagnostic.h"

namespace legopt::client {

/// Renders lines such as "ok    quaternion order  w first: ...: quaternions are w x y z", with "warn" or "FAIL" for
/// problems; the remedy follows on a separate line.
std::string RenderDatasetFindings(std::span<const DatasetDiagnostic> findings, const TextLayout& layout);

/// Returns one object per finding with severity, check, file, field, value, message, fix.
nlohmann::ordered_json DatasetFindingsToJson(std::span<const DatasetDiagnostic> findings);

}  // namespace legopt::client
