#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/archive/archive.h"
#include "client/report/table.h"
#include "legopt/dataset/dataset.h"
#include "legopt/judge/judge.h"

namespace legopt::client {

/// Verdicts on one result of an archive.
struct JudgedResult {
  EnumArray<Rule, std::optional<Verdict>> verdicts;  ///< nullopt: there is no solution, and none is stored
  std::optional<double> cost;                        ///< nullopt: none
  bool differs = false;                              ///< a stored verdict or the stored cost is another one
  std::optional<Evaluation> evaluation;              ///< nullopt: there was nothing to judge
};

/// Judgement of an archive: one element for each result, in order.
struct JudgedArchive {
  std::vector<JudgedResult> results;
  std::int64_t differing = 0;
};

/// Judges every solution of an archive again. A result without a solution keeps its stored verdicts and has no cost,
/// unless a stored verdict is success: it is then judged as a solution of no waypoints. `progress` is called with the
/// number of judged results. `dataset` must have the archive's hash. Throws InputError if it
/// lacks a problem or has a corrupt mesh.
JudgedArchive JudgeArchive(const Archive& archive, const std::shared_ptr<const Dataset>& dataset,
                           const std::function<void(std::size_t)>& progress = {});

/// Returns the judgement as JSON: the archive's hash, and all verdicts and costs. Equal archives give equal texts on
/// every machine.
nlohmann::ordered_json JudgementJson(const Archive& archive, const JudgedArchive& judged);

/// Returns one row for each method, task and initialization: jobs, results, solved by each rule, differing results.
Table JudgementTable(const Archive& archive, const JudgedArchive& judged);

}  // namespace legopt::client
