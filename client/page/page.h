#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/build_identity.h"
#include "client/page/page_dataset.h"
#include "client/page/page_experiment.h"
#include "client/page/page_solutions.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// An experiment of a page: its source and id (default: the newest).
struct PageSource {
  SourceOptions source;
  std::optional<std::int64_t> experiment;
};

/// Returns the requested rule, or else the weakest of the experiments' rules, because every experiment has verdicts by
/// that one; kSolid without experiments. Throws the errors of FindExperiment.
Rule PageRule(const std::vector<PageSource>& sources, std::optional<Rule> asked);

/// Contents of a page with figures.
struct FigureRequest {
  std::vector<PageSource> sources;  ///< not empty
  Rule rule = Rule::kSolid;
  ResultFilter filter = {};  ///< cells to show of every experiment
  /// Available datasets, for the 3D view; a note lists experiments on other datasets.
  std::vector<std::shared_ptr<const Dataset>> datasets;
  app::BuildFacts build;
  std::function<void(const std::string&)> tell = {};  ///< receives progress messages
};

/// All data of a page except its solutions.
struct PageFigures {
  nlohmann::ordered_json root;  ///< "page" of docs/reference/page-data.md, without "notes" and "chunks"
  std::string title;
  std::vector<std::string> notes;                        ///< notes for the reader
  std::vector<PageExperiment> experiments;               ///< ordered as in the request
  std::vector<std::unique_ptr<ResultSource>> sources;    ///< parallel to `experiments`
  std::vector<std::shared_ptr<const Dataset>> datasets;  ///< parallel to `experiments`; null if unavailable
};

/// Reads and computes all figures. Throws the errors of ReadBenchmarkTable.
PageFigures ReadFigures(const FigureRequest& request);

/// Robot, scene and problems of one dataset in a separate block.
struct PageGeometry {
  std::string block;  ///< block name
  std::string bytes;  ///< uncompressed
};

/// Adds each available dataset once to figures->root, with the problems of all its experiments; `problems` has one
/// element per experiment. Returns the blocks to add to the page. Throws InputError for a corrupt mesh.
std::vector<PageGeometry> AddDatasets(const std::vector<ProblemIds>& problems, PageFigures* figures);

/// Returns the members that every page begins with.
nlohmann::ordered_json PageHead(const std::string& kind, const std::string& title, const app::BuildFacts& build);

/// Arguments of `legopt report`.
struct ReportRequest : FigureRequest {
  std::string home = {};                ///< address of the site that the page belongs to; empty: none
  std::size_t most_bytes = 25'000'000;  ///< size limit of the file; solutions beyond it are omitted with a note
};

/// A page with notes for its reader and its author.
struct Page {
  std::string text;                ///< contents of the file
  std::vector<std::string> notes;  ///< omitted, unfinished or disturbed parts
};

/// Reads, computes and judges all contents of the page. Throws the errors of ReadBenchmarkTable and DescribeDataset.
Page MakeReport(const ReportRequest& request);

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
