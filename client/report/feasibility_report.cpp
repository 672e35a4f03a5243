#include "client/report/feasibility_report.h"

#include <cstddef>
#include <optional>
#include <vector>

#include "client/report/json_text.h"
#include "legopt/planning/certify/dataset_certifier.h"
#include "legopt/types/feasibility.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

std::string ReasonOf(const std::optional<certify::StanceEvidence>& evidence) {
  if (!evidence) return "not looked at yet";
  if (evidence->feasibility == Feasibility::kInfeasible) return evidence->proof;
  return "none from " + std::to_string(evidence->starts) + " starts; found " + evidence->obstruction.Describe();
}

}  // namespace

Listing FeasibilityCounts(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue) {
  Listing listing;
  listing.columns = {"task", "problems"};
  for (const auto& word : kEnumNames<Feasibility>) listing.columns.emplace_back(word.word);
  for (const TaskDescription& description : ProblemTasks()) {
    const EnumArray<Feasibility, int> counts = certify::CountProblems(certificate, catalogue, description.task);
    auto& row = listing.rows.emplace_back();
    row.emplace_back(std::string(ToString(description.task)));
    row.emplace_back(catalogue.problems(description.task).size());
    for (const int count : counts) row.emplace_back(count);
  }
  return listing;
}

Listing UncertifiedStances(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                           const Dataset& dataset) {
  Listing listing;
  listing.columns = {"task", "problem", "stance", "feasibility", "reason", "nearest"};
  for (const TaskDescription& description : ProblemTasks()) {
    const auto& problems = catalogue.problems(description.task);
    for (std::size_t p = 0; p < problems.size(); ++p) {
      for (std::size_t place = 0; place < problems[p].size(); ++place) {
        const auto& evidence = certificate.stances[static_cast<std::size_t>(problems[p][place])];
        if (evidence && evidence->feasibility == Feasibility::kCertified) continue;
        const Feasibility feasibility = evidence ? evidence->feasibility : Feasibility::kOpen;
        listing.rows.push_back({std::string(ToString(description.task)), dataset.problems(description.task)[p].id,
                                place, std::string(ToString(feasibility)), ReasonOf(evidence),
                                evidence ? evidence->obstruction.nearest : ""});
      }
    }
  }
  return listing;
}

std::string RenderFeasibility(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                              const Dataset& dataset, TableFormat format, const TextLayout& layout) {
  const Listing counts = FeasibilityCounts(certificate, catalogue);
  if (format == TableFormat::kCsv) return RenderListing(counts, format);
  const Listing stances = UncertifiedStances(certificate, catalogue, dataset);
  if (format == TableFormat::kJson) {
    const nlohmann::ordered_json json{{"dataset", dataset.name()},
                                      {"hash", dataset.content_hash()},
                                      {"complete", certificate.IsComplete()},
                                      {"tasks", ListingToJson(counts)},
                                      {"uncertified", ListingToJson(stances)}};
    return JsonText(json) + "\n";
  }
  std::vector<Table> tables = {TableOf(counts)};
  if (!stances.rows.empty()) tables.push_back(TableOf(stances));
  return RenderTables(tables, format, layout);
}

}  // namespace legopt::client
