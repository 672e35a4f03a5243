#include "client/report/finding_report.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "app/printable.h"
#include "client/report/listing.h"

namespace legopt::client {
namespace {

std::string Mark(DatasetDiagnostic::Severity severity) {
  switch (severity) {
    case DatasetDiagnostic::Severity::kInfo:
      return "ok";
    case DatasetDiagnostic::Severity::kWarning:
      return "warn";
    case DatasetDiagnostic::Severity::kError:
      return "FAIL";
  }
  return "";
}

/// Returns "FILE: FIELD: VALUE MESSAGE", without the empty parts.
std::string Sentence(const DatasetDiagnostic& finding) {
  std::string text = finding.file;
  for (const std::string& part : {finding.field, finding.value}) {
    if (!part.empty()) text += (text.empty() ? "" : ": ") + part;
  }
  if (text.empty()) return finding.message;
  return text + (finding.value.empty() ? ": " : " -- ") + finding.message;
}

}  // namespace

std::string RenderDatasetFindings(std::span<const DatasetDiagnostic> findings, const TextLayout& layout) {
  std::vector<std::vector<std::string>> lines;
  for (const DatasetDiagnostic& finding : findings) {
    lines.push_back({Mark(finding.severity), finding.check, app::Printable(Sentence(finding))});
    if (!finding.fix.empty()) lines.push_back({"", "", "-> " + app::Printable(finding.fix)});
  }
  return AlignSentences(lines, layout.width);
}

nlohmann::ordered_json DatasetFindingsToJson(std::span<const DatasetDiagnostic> findings) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const DatasetDiagnostic& f : findings) {
    array.push_back({{"severity", ToString(f.severity)},
                     {"check", f.check},
                     {"file", f.file},
                     {"field", f.field},
                     {"value", f.value},
                     {"message", f.message},
                     {"fix", f.fix}});
  }
  return array;
}

}  // namespace legopt::client
