#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/page/page_dataset.h"
#include "client/page/page_experiment.h"
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

/// The rule asked for, else the weakest of the experiments' rules: every experiment has verdicts by that one. Solid
/// where there is no experiment yet. Errors as of FindExperiment.
Rule PageRule(const std::vector<PageSource>& sources, std::optional<Rule> asked);

/// Of what a page with figures is made.
struct FigureRequest {
  std::vector<PageSource> sources;  ///< not empty
  Rule rule = Rule::kSolid;
  /// At hand, for the 3D view; experiments on others have none, and it is said.
  std::vector<std::shared_ptr<const Dataset>> datasets;
  programs::BuildFacts build;
  std::function<void(const std::string&)> tell = {};  ///< progress, for people
};

/// Everything of a page but its solutions.
struct PageFigures {
  nlohmann::ordered_json root;  ///< "page" of docs/page-data.md, without "notes" and "chunks"
  std::string title;
  std::vector<std::string> notes;                        ///< what a reader must know
  std::vector<PageExperiment> experiments;               ///< in the order of the request
  std::vector<std::unique_ptr<ResultSource>> sources;    ///< theirs
  std::vector<std::shared_ptr<const Dataset>> datasets;  ///< theirs; null where it is not at hand
};

/// Reads and computes all figures. Errors as of ReadBenchmarkTable.
PageFigures ReadFigures(const FigureRequest& request);

/// Robot, scene and problems of one dataset, as a block of its own.
struct PageGeometry {
  std::string block;  ///< its name
  std::string bytes;  ///< not yet compressed
};

/// Enters each dataset at hand once into figures->root, with the problems of all its experiments; `problems`: of each
/// experiment. Returns what must be added as blocks. Throws InputError for a corrupt mesh.
std::vector<PageGeometry> AddDatasets(const std::vector<ProblemIds>& problems, PageFigures* figures);

/// What every page begins with.
nlohmann::ordered_json PageHead(const std::string& kind, const std::string& title, const programs::BuildFacts& build);

}  // namespace legopt::client
