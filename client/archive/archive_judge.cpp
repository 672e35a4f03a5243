#include "client/archive/archive_judge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace legopt::client {
namespace {

bool ClaimsSuccess(const ArchivedResult& result) {
  return std::ranges::any_of(kEnumNames<Rule>,
                             [&](const auto& row) { return result.verdicts[row.value] == Verdict::kSuccess; });
}

JudgedResult JudgeResult(const ArchivedResult& result, const Dataset& dataset, Judge& judge) {
  JudgedResult judged;
  if (result.waypoints.empty() && !ClaimsSuccess(result)) {
    judged.verdicts = result.verdicts;
    return judged;
  }
  Evaluation evaluation = judge.Evaluate(result.task, dataset.problem(result.task, result.problem), result.waypoints);
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    judged.verdicts[rule] = evaluation.by(rule);
    judged.differs |= result.verdicts[rule] && *result.verdicts[rule] != evaluation.by(rule);
  }
  if (std::isfinite(evaluation.cost)) judged.cost = evaluation.cost;
  judged.differs |= judged.cost != result.cost;
  judged.evaluation = std::move(evaluation);
  return judged;
}

nlohmann::ordered_json WordOf(const std::optional<Verdict>& verdict) {
  return verdict ? nlohmann::ordered_json(ToString(*verdict)) : nlohmann::ordered_json();
}

using CellKey = std::tuple<std::size_t, Task, Initialization>;

struct CellCounts {
  std::int64_t results = 0, differing = 0;
  EnumArray<Rule, std::int64_t> solved{};
};

std::map<CellKey, CellCounts> Count(const Archive& archive, const JudgedArchive& judged) {
  std::map<CellKey, CellCounts> counts;
  for (std::size_t i = 0; i < archive.results.size(); ++i) {
    const ArchivedResult& result = archive.results[i];
    CellCounts& cell = counts[{result.method, result.task, result.initialization}];
    ++cell.results;
    cell.differing += judged.results[i].differs ? 1 : 0;
    for (const auto& [rule, word] : kEnumNames<Rule>) {
      cell.solved[rule] += judged.results[i].verdicts[rule] == Verdict::kSuccess ? 1 : 0;
    }
  }
  return counts;
}

}  // namespace

JudgedArchive JudgeArchive(const Archive& archive, const std::shared_ptr<const Dataset>& dataset,
                           const std::function<void(std::size_t)>& progress) {
  Judge judge(dataset);
  JudgedArchive judged;
  for (const ArchivedResult& result : archive.results) {
    judged.results.push_back(JudgeResult(result, *dataset, judge));
    judged.differing += judged.results.back().differs ? 1 : 0;
    if (progress) progress(judged.results.size());
  }
  return judged;
}

nlohmann::ordered_json JudgementJson(const Archive& archive, const JudgedArchive& judged) {
  nlohmann::ordered_json json = {{"archive", archive.hash},
                                 {"dataset_hash", archive.dataset_hash},
                                 {"jobs", archive.num_jobs()},
                                 {"results", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < archive.results.size(); ++i) {
    const ArchivedResult& result = archive.results[i];
    nlohmann::ordered_json row = {{"method", archive.methods[result.method].name},
                                  {"method_hash", archive.methods[result.method].hash},
                                  {"task", ToString(result.task)},
                                  {"initialization", ToString(result.initialization)},
                                  {"problem", result.problem},
                                  {"repetition", result.repetition}};
    for (const auto& [rule, word] : kEnumNames<Rule>) row[std::string(word)] = WordOf(judged.results[i].verdicts[rule]);
    row["cost"] = judged.results[i].cost ? nlohmann::ordered_json(*judged.results[i].cost) : nlohmann::ordered_json();
    row["differs"] = judged.results[i].differs;
    json["results"].push_back(std::move(row));
  }
  return json;
}

Table JudgementTable(const Archive& archive, const JudgedArchive& judged) {
  Table table;
  table.columns = {{"method", "Method", "", Alignment::kLeft},
                   {"multi_starts", "Multi-starts"},
                   {"sample_size", "Sample size", "%"},
                   {"task", "Task", "", Alignment::kLeft},
                   {"initialization", "Initial guess", "", Alignment::kLeft},
                   {"jobs", "Jobs"},
                   {"results", "Results"}};
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    table.columns.push_back({"solved_" + std::string(word), "Solved, " + std::string(word)});
  }
  table.columns.push_back({"differing", "Differing"});
  const std::map<CellKey, CellCounts> counts = Count(archive, judged);
  for (std::size_t method = 0; method < archive.methods.size(); ++method) {
    for (const ArchivedTask& task : archive.tasks) {
      for (const Initialization initialization : archive.initializations) {
        const auto found = counts.find({method, task.task, initialization});
        const CellCounts cell = found == counts.end() ? CellCounts{} : found->second;
        TableRow row;
        row.cells = {TextCell(archive.methods[method].name),
                     CountCell(archive.methods[method].multi_starts),
                     CountCell(archive.methods[method].sample_size),
                     TextCell(std::string(ToString(task.task))),
                     TextCell(std::string(ToString(initialization))),
                     CountCell(static_cast<std::int64_t>(task.problems.size()) * archive.repetitions),
                     CountCell(cell.results)};
        for (const auto& [rule, word] : kEnumNames<Rule>) row.cells.push_back(CountCell(cell.solved[rule]));
        row.cells.push_back(CountCell(cell.differing));
        table.rows.push_back(std::move(row));
      }
    }
  }
  return table;
}

}  // namespace legopt::client
