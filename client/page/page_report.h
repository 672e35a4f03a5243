#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "programs/build_identity.h"
#include "words/result.h"

namespace legopt::client {

/// One experiment of a page: where it is, and which one (default: the newest).
struct PageSource {
  SourceOptions source;
  std::optional<std::int64_t> experiment;
};

/// What `legopt report` is asked for.
struct ReportRequest {
  std::vector<PageSource> sources;  ///< not empty
  Rule rule = Rule::kLiteral;
  /// At hand, for the 3D view; experiments on others have none, and it is said.
  std::vector<std::shared_ptr<const Dataset>> datasets;
  std::size_t most_bytes = 25'000'000;  ///< of the file; what would go beyond is left out, and said
  programs::BuildFacts build;
  std::function<void(const std::string&)> tell;  ///< progress, for people
};

/// A page, and what its reader and its writer should know of it.
struct Page {
  std::string text;                ///< of the file
  std::vector<std::string> notes;  ///< what is left out, unfinished, contended
};

/// Reads, computes and judges all that the page shows. Errors as of ReadBenchmarkTable and DescribeDataset.
Page MakeReport(const ReportRequest& request);

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
