#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// One thing that was found out about a dataset or about the files that it is made from.
struct DatasetFinding {
  /// How bad it is.
  enum class Severity {
    kInfo,     ///< as it should be, or worth knowing
    kWarning,  ///< a fault that the dataset can be used with
    kError,    ///< results on such a dataset would mean nothing
  };
  Severity severity = Severity::kInfo;  ///< of this finding
  std::string check;                    ///< e.g. "quaternion order"
  std::string file;                     ///< inside the folder in question; may be empty
  std::string field;                    ///< element, key or problems; may be empty
  std::string value;                    ///< what was counted or measured; may be empty
  std::string message;                  ///< what that means
  std::string fix;                      ///< what the user can do; empty when all is well
};

/// "info", "warning" or "error".
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

/// Whether results on this dataset would mean nothing.
inline bool AnyError(std::span<const DatasetFinding> findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const DatasetFinding& f) { return f.severity == DatasetFinding::Severity::kError; });
}

}  // namespace legopt
