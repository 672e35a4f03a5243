#include "client/report/certified_counts.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "app/data_folder.h"
#include "db/named_queries.h"
#include "legopt/types/feasibility.h"

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
  table->certified = true;
  const Listing jobs = source.Query(
      db::Sql(db::Query::kJobsByProblem, {{"experiment_id", table->experiment_id}, {"rule", selection.rule}}));
  const auto integer = [&](std::size_t row, const char* column) { return jobs.At(row, column).get<std::int64_t>(); };
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) {
    const auto row = std::find_if(table->rows.begin(), table->rows.end(), [&](const BenchmarkRow& candidate) {
      return candidate.method_id == integer(i, "method_id");
    });
    if (row == table->rows.end()) continue;  // not selected
    const auto task = jobs.EnumAt<Task>(i, "task");
    const auto cell = row->cells.find({task, jobs.EnumAt<Initialization>(i, "initialization")});
    if (cell == row->cells.end()) continue;  // not selected
    const auto feasibility = Known(certificate, task, static_cast<int>(integer(i, "problem_id")));
    JobCounts& counts = cell->second.by_feasibility[feasibility];
    counts.n += integer(i, "n");
    counts.solved += integer(i, "solved");
  }
}

}  // namespace legopt::client
