#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "client/report/text_layout.h"
#include "legopt/import/finding.h"

namespace legopt::client {

/// "ok    quaternion order  w first: ...: quaternions are w x y z" lines, with "warn" or "FAIL" for faults; what can be
/// done follows on a line of its own.
std::string RenderDatasetFindings(std::span<const DatasetFinding> findings, const TextLayout& layout);

/// One object per finding with severity, check, file, field, value, message, fix.
nlohmann::ordered_json DatasetFindingsToJson(std::span<const DatasetFinding> findings);

}  // namespace legopt::client
