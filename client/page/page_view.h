#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/build_identity.h"
#include "client/page/page_report.h"
#include "client/page/page_solutions.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// A job to be displayed, read from the database.
struct ViewedJob {
  PageJob job;
  nlohmann::ordered_json json;  ///< element of "jobs" in docs/reference/page-data.md
  std::string dataset_name, dataset_hash;
};

/// Reads a job. Throws ClientError (kUsage) if it does not exist or has no solution.
ViewedJob ReadViewedJob(ResultSource& source, std::int64_t id);

/// Arguments of `legopt view`: a job, or a problem alone.
struct ViewRequest {
  SourceOptions source;
  std::optional<std::int64_t> job;
  std::optional<std::int64_t> ghost;  ///< another job of the same problem, drawn transparently
  Task task = Task::kPosture;         ///< task of `problem`
  std::optional<int> problem;
  std::shared_ptr<const Dataset> dataset;
  app::BuildFacts build;
};

/// Returns the page of a view. Throws ClientError: kUsage for a job that does not exist or has no solution,
/// kDatasetMismatch if `dataset` is not the job's; InputError if the dataset does not have the problem.
Page MakeView(const ViewRequest& request);

}  // namespace legopt::client
