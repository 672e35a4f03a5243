#include "client/report/certificate_report.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
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

namespace {

using ProblemKeys = std::vector<std::int64_t>;

// Calls `read` with the rows of a query for at most so many problems at a time, because the text of a query names them.
template <class Read>
void QueryProblems(ResultSource& source, db::Query query, const BenchmarkTable& table, const ProblemKeys& keys,
                   const Read& read) {
  constexpr std::size_t kMaxNamed = 5000;
  for (std::size_t begin = 0; begin < keys.size(); begin += kMaxNamed) {
    const std::size_t end = std::min(begin + kMaxNamed, keys.size());
    const ProblemKeys named(keys.begin() + static_cast<std::ptrdiff_t>(begin),
                            keys.begin() + static_cast<std::ptrdiff_t>(end));
    const Listing rows = source.Query(
        db::Sql(query, {{"experiment_id", table.experiment_id}, {"rule", table.rule}, {"problem_keys", named}}));
    for (std::size_t i = 0; i < rows.rows.size(); ++i) read(rows, i);
  }
}

// Returns the problems that do not count as certified: those proven infeasible, and open ones that no job solved. What
// any method solved is feasible, whether or not the certificate has a posture.
EnumArray<Feasibility, ProblemKeys> FindUncertified(ResultSource& source, const BenchmarkTable& table,
                                                    const certify::ProblemFeasibility& certificate) {
  const Listing problems = source.Query(db::Sql(db::Query::kDatasetProblems, {{"experiment_id", table.experiment_id}}));
  EnumArray<Feasibility, ProblemKeys> known;
  for (std::size_t i = 0; i < problems.rows.size(); ++i) {
    known[Known(certificate, problems.EnumAt<Task>(i, "task"), problems.At(i, "problem_id").get<int>())].push_back(
        problems.At(i, "problem_key").get<std::int64_t>());
  }
  EnumArray<Feasibility, ProblemKeys> uncertified;
  uncertified[Feasibility::kInfeasible] = std::move(known[Feasibility::kInfeasible]);
  QueryProblems(source, db::Query::kUnsolvedProblems, table, known[Feasibility::kOpen],
                [&](const Listing& rows, std::size_t i) {
                  uncertified[Feasibility::kOpen].push_back(rows.At(i, "problem_key").get<std::int64_t>());
                });
  return uncertified;
}

// Returns the cell of a method; null if it is not selected.
BenchmarkCell* FindCell(std::int64_t method_id, const BenchmarkColumn& column, BenchmarkTable* table) {
  const auto row = std::ranges::find(table->rows, method_id, &BenchmarkRow::method_id);
  if (row == table->rows.end()) return nullptr;
  const auto cell = row->cells.find(column);
  return cell == row->cells.end() ? nullptr : &cell->second;
}

}  // namespace

void AddCertifiedCounts(ResultSource& source, const certify::ProblemFeasibility& certificate, BenchmarkTable* table) {
  table->certificate = CertificateFacts{certificate.file_hash, certificate.starts};
  for (BenchmarkRow& row : table->rows) {
    for (auto& [column, cell] : row.cells) cell.by_feasibility[Feasibility::kCertified] = {cell.n, cell.solved};
  }
  const EnumArray<Feasibility, ProblemKeys> uncertified = FindUncertified(source, *table, certificate);
  for (const Feasibility feasibility : {Feasibility::kInfeasible, Feasibility::kOpen}) {
    const auto move_counts = [&](const Listing& rows, std::size_t i) {
      BenchmarkCell* cell =
          FindCell(rows.At(i, "method_id").get<std::int64_t>(),
                   {rows.EnumAt<Task>(i, "task"), rows.EnumAt<Initialization>(i, "initialization")}, table);
      if (cell == nullptr) return;
      JobCounts& certified = cell->by_feasibility[Feasibility::kCertified];
      JobCounts moved{rows.At(i, "n").get<std::int64_t>(), rows.At(i, "solved").get<std::int64_t>()};
      // Results that arrived since the table was read are not in it.
      moved.solved = feasibility == Feasibility::kOpen ? 0 : std::min(moved.solved, certified.solved);
      cell->by_feasibility[feasibility] += moved;
      certified -= moved;
    };
    QueryProblems(source, db::Query::kJobsOfProblems, *table, uncertified[feasibility], move_counts);
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
