#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// A finding about a dataset or its source files.
struct DatasetDiagnostic {
  /// Severity of a finding.
  enum class Severity {
    kInfo,      ///< valid, or worth knowing
    kRepaired,  ///< a fault that was repaired without effect on results
    kWarning,   ///< a fault, but the dataset is usable
    kError,     ///< results with this dataset would be meaningless
  };
  Severity severity = Severity::kInfo;
  std::string check;    ///< e.g. "quaternion order"
  std::string file;     ///< path relative to the folder; may be empty
  std::string field;    ///< element, key or problems; may be empty
  std::string value;    ///< count or measurement; may be empty
  std::string message;  ///< meaning of the value
  std::string fix;      ///< advice to the user; empty if there is no problem
};

/// Returns "info", "repaired", "warning" or "error".
inline std::string_view ToString(DatasetDiagnostic::Severity severity) {
  switch (severity) {
    case DatasetDiagnostic::Severity::kInfo:
      return "info";
    case DatasetDiagnostic::Severity::kRepaired:
      return "repaired";
    case DatasetDiagnostic::Severity::kWarning:
      return "warning";
    case DatasetDiagnostic::Severity::kError:
      return "error";
  }
  return "";
}

/// Returns true if one of the findings is an error.
inline bool AnyError(std::span<const DatasetDiagnostic> findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const DatasetDiagnostic& f) { return f.severity == DatasetDiagnostic::Severity::kError; });
}

}  // namespace legopt
