#include "client/report/finding_report.h"

#include <nlohmann/json.hpp>
#include <vector>

namespace legopt::client {
namespace {

std::string Mark(DatasetDiagnostic::Severity severity) {
  switch (severity) {
    case DatasetDiagnostic::Severity::kInfo:
      return "ok";
    case DatasetDiagnostic::Severity::kRepaired:
      return "repaired";
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

Table TableOf(std::span<const DatasetDiagnostic> findings) {
  Table table;
  table.has_headings = false;
  table.columns = {{"severity", "", "", Alignment::kLeft},
                   {"check", "", "", Alignment::kLeft},
                   {"message", "", "", Alignment::kLeft}};
  for (const DatasetDiagnostic& finding : findings) {
    table.rows.push_back({{TextCell(Mark(finding.severity)), TextCell(finding.check), TextCell(Sentence(finding))}});
    if (!finding.fix.empty()) table.rows.push_back({{TextCell(""), TextCell(""), TextCell("-> " + finding.fix)}});
  }
  return table;
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
