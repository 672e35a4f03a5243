#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "client/page/page_report.h"
#include "client/page/page_solutions.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "programs/build_identity.h"
#include "words/task.h"

namespace legopt::client {

/// A job that a view shows, as the database has it.
struct ViewedJob {
  PageJob job;
  nlohmann::ordered_json json;  ///< "jobs" of docs/page-data.md
  std::string dataset_name, dataset_hash;
};

/// Throws ClientError, kUsage, for a job that does not exist or has no solution.
ViewedJob ReadViewedJob(ResultSource& source, std::int64_t id);

/// What `legopt view` is asked for: a job, or a problem alone.
struct ViewRequest {
  SourceOptions source;
  std::optional<std::int64_t> job;
  std::optional<std::int64_t> ghost;  ///< another job of the same problem, drawn transparently
  Task task = Task::kPosture;         ///< of `problem`
  std::optional<int> problem;
  std::shared_ptr<const Dataset> dataset;
  programs::BuildFacts build;
};

/// Errors: ClientError, kUsage for a job that does not exist or has no solution, kDatasetMismatch where `dataset` is
/// not the job's; InputError for a problem that the dataset has not.
Page MakeView(const ViewRequest& request);

}  // namespace legopt::client
