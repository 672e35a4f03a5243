#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// A finding about a dataset or its source files.
struct DatasetFinding {
  /// Severity of a finding.
  enum class Severity {
    kInfo,     ///< valid, or worth knowing
    kWarning,  ///< a fault, but the dataset is usable
    kError,    ///< results with this dataset would be meaningless
  };
  Severity severity = Severity::kInfo;
  std::string check;    ///< e.g. "quaternion order"
  std::string file;     ///< path relative to the folder; may be empty
  std::string field;    ///< element, key or problems; may be empty
  std::string value;    ///< count or measurement; may be empty
  std::string message;  ///< meaning of the value
  std::string fix;      ///< advice to the user; empty if there is no problem
};

/// Returns "info", "warning" or "error".
inline std::string_view ToString(DatasetFinding::Severity severity) {
  switch (severity) {
    case DatasetFinding::Severity::kInfo:
      return "info";
    case DatasetFinding::Severity::kWarning:
      return "warning";
    case DatasetFinding::Severity::kError:
      return "error";
  }
  return "";
}

/// Returns true if one of the findings is an error.
inline bool AnyError(std::span<const DatasetFinding> findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const DatasetFinding& f) { return f.severity == DatasetFinding::Severity::kError; });
}

}  // namespace legopt
