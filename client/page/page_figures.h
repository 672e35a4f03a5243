#pragma once

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
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/types/check.h"

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

}  // namespace legopt::client
