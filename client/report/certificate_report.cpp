#include "client/report/certificate_report.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/data_folder.h"
#include "client/report/escaped_text.h"
#include "db/named_queries.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

/// Returns the feasibility of a problem; tasks may share the problems of another task.
Feasibility Known(const certify::ProblemFeasibility& certificate, Task task, int problem_id) {
  const auto& problems = certificate.problems[DescriptionOf(task).problems];
  const auto problem = problems.find(problem_id);
  return problem == problems.end() ? Feasibility::kOpen : problem->second;
}

}  // namespace

certify::ProblemFeasibility ReadCertificateOf(std::filesystem::path file, const ExperimentInfo& experiment) {
  if (std::filesystem::is_directory(file)) file /= certify::kCertificateFileName;
  certify::ProblemFeasibility certificate = certify::ReadProblemFeasibility(file);
  certify::RequireCertificateOf(certificate.dataset_hash, experiment.dataset_hash, file, experiment.dataset_name);
  return certificate;
}

std::optional<certify::ProblemFeasibility> FindCertificate(const std::filesystem::path& folder,
                                                           const ExperimentInfo& experiment) {
  const std::filesystem::path file = folder / certify::kCertificateFileName;
  if (!std::filesystem::exists(file)) return std::nullopt;
  certify::ProblemFeasibility certificate = certify::ReadProblemFeasibility(file);
  if (certificate.dataset_hash != experiment.dataset_hash) return std::nullopt;
  return certificate;
}

std::optional<certify::ProblemFeasibility> FindEmbeddedCertificate(const ExperimentInfo& experiment) {
  for (const auto& folder : app::EmbeddedDatasetFolders()) {
    if (auto found = FindCertificate(folder, experiment)) return found;
  }
  return std::nullopt;
}

void AddCertifiedCounts(ResultSource& source, const TableSelection& selection,
                        const certify::ProblemFeasibility& certificate, BenchmarkTable* table) {
  table->certificate = CertificateFacts{certificate.file_hash, certificate.starts};
  const Listing jobs = source.Query(
      db::Sql(db::Query::kJobsByProblem, {{"experiment_id", table->experiment_id}, {"rule", selection.rule}}));
  const auto integer = [&](std::size_t row, const char* column) { return jobs.At(row, column).get<std::int64_t>(); };
  // What any method solved is feasible, whether or not the certificate has a posture.
  std::set<std::pair<Task, int>> solved;
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) {
    if (integer(i, "solved") > 0) {
      solved.emplace(jobs.EnumAt<Task>(i, "task"), static_cast<int>(integer(i, "problem_id")));
    }
  }
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) {
    const auto row = std::find_if(table->rows.begin(), table->rows.end(), [&](const BenchmarkRow& candidate) {
      return candidate.method_id == integer(i, "method_id");
    });
    if (row == table->rows.end()) continue;  // not selected
    const auto task = jobs.EnumAt<Task>(i, "task");
    const auto cell = row->cells.find({task, jobs.EnumAt<Initialization>(i, "initialization")});
    if (cell == row->cells.end()) continue;  // not selected
    const auto problem = static_cast<int>(integer(i, "problem_id"));
    Feasibility feasibility = Known(certificate, task, problem);
    if (feasibility == Feasibility::kOpen && solved.contains({task, problem})) feasibility = Feasibility::kCertified;
    JobCounts& counts = cell->second.by_feasibility[feasibility];
    counts.n += integer(i, "n");
    counts.solved += integer(i, "solved");
  }
}

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
