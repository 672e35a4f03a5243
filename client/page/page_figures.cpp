#include "client/page/page_figures.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "client/client_error.h"
#include "db/named_queries.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kShownHash = 12;

std::string PlaceOf(const SourceOptions& options) { return options.db ? *options.db : std::string("the server"); }

// Returns the file name of each experiment, without its folder because pages are sent to others. The names are empty if
// all experiments have one source, so that a page is identical for a server and its file.
std::vector<std::string> ShownPlaces(const FigureRequest& request) {
  std::set<std::string> places;
  for (const PageSource& source : request.sources) places.insert(PlaceOf(source.source));
  std::vector<std::string> shown;
  for (const PageSource& source : request.sources) {
    const std::string place = PlaceOf(source.source);
    shown.push_back(places.size() > 1 ? std::filesystem::path(place).filename().string() : "");
  }
  return shown;
}

// Compares the first experiment with each of the others if possible.
Json AcrossJson(const FigureRequest& request, const std::vector<PageExperiment>& pages) {
  Json list = Json::array();
  for (std::size_t i = 1; i < pages.size(); ++i) {
    Json json = {{"a", 0}, {"b", i}};
    ComparisonRequest comparison;
    const PageSource &a = request.sources[0], &b = request.sources[i];
    comparison.rule = request.rule;
    comparison.filter = request.filter;
    comparison.source = a.source;
    const std::int64_t id_a = pages[0].experiment.info.id, id_b = pages[i].experiment.info.id;
    try {
      if (PlaceOf(a.source) == PlaceOf(b.source)) {
        comparison.a = std::to_string(id_a);
        comparison.b = std::to_string(id_b);
      } else if (id_a == id_b || (!a.experiment && !b.experiment)) {
        comparison.a = PlaceOf(a.source);
        comparison.b = PlaceOf(b.source);
        if (id_a == id_b) comparison.experiment = id_a;
      } else {
        throw ClientError(ExitCode::kUsage, "experiments of different numbers in different files are not compared");
      }
      json.update(DescribeComparison(ReadComparison(comparison), pages[0].experiment, pages[i].experiment));
    } catch (const ClientError& error) {
      json["refused"] = error.what();
    }
    list.push_back(std::move(json));
  }
  return list;
}

std::string Named(const PageExperiment& page) {
  return "experiment " + std::to_string(page.experiment.info.id) + " '" + page.experiment.info.name + "'";
}

void NoteState(const PageExperiment& page, std::vector<std::string>* notes) {
  const auto unfinished = page.json.at("unfinished").get<std::int64_t>();
  if (unfinished > 0) {
    notes->push_back(Named(page) + " is unfinished: " + std::to_string(unfinished) +
                     " jobs have no end yet; every figure is of the rest");
  }
  std::int64_t contended = 0, reported = 0;
  for (const SolveCell& cell : page.experiment.cells) {
    for (const Solve& solve : cell.solves) {
      contended += solve.contended ? 1 : 0;
      reported += solve.reported ? 1 : 0;
    }
  }
  if (contended * 20 > reported) {
    notes->push_back(Named(page) + ": others disturbed " + std::to_string(contended) + " of " +
                     std::to_string(reported) + " runs; of those CPU times are taken, except in means over solved");
  }
}

std::shared_ptr<const Dataset> FindDataset(const FigureRequest& request, const PageExperiment& page,
                                           std::vector<std::string>* notes) {
  const ExperimentInfo& info = page.experiment.info;
  for (const auto& dataset : request.datasets) {
    if (dataset->content_hash() == info.dataset_hash) return dataset;
  }
  notes->push_back(Named(page) + " ran on dataset '" + info.dataset_name + "' of hash " + info.dataset_hash +
                   ", which was not found: no 3D; name its folder with --dataset");
  return nullptr;
}

}  // namespace

Rule PageRule(const std::vector<PageSource>& sources, std::optional<Rule> asked) {
  if (asked) return *asked;
  Rule weakest = Rule::kSolid;
  for (const PageSource& place : sources) {
    const auto source = OpenResults(place.source);
    const bool none_yet =
        !place.experiment && source->Query(db::Sql(db::Query::kExperimentCount)).At(0, "n").get<std::int64_t>() == 0;
    if (!none_yet) weakest = std::min(weakest, FindExperiment(*source, place.experiment).rule);
  }
  return weakest;
}

Json PageHead(const std::string& kind, const std::string& title, const app::BuildFacts& build) {
  return {{"format", kFormat},
          {"kind", kind},
          {"title", title},
          {"legopt", {{"version", build.version}, {"build_id", app::BuildId(build)}}}};
}

PageFigures ReadFigures(const FigureRequest& request) {
  PageFigures figures;
  std::vector<PageExperiment>& pages = figures.experiments;
  const std::vector<std::string> places = ShownPlaces(request);
  for (const PageSource& source : request.sources) {
    figures.sources.push_back(OpenResults(source.source));
    pages.push_back(DescribeExperiment(*figures.sources.back(), source.source, places[pages.size()], source.experiment,
                                       {request.rule, request.filter}));
    NoteState(pages.back(), &figures.notes);
    figures.datasets.push_back(FindDataset(request, pages.back(), &figures.notes));
    if (request.tell) request.tell("figures of " + Named(pages.back()) + " computed");
  }
  if (!request.filter.empty()) figures.notes.push_back("Only a part of the results: " + Describe(request.filter));
  figures.title = pages.size() == 1 ? pages[0].experiment.info.name : std::to_string(pages.size()) + " experiments";
  figures.root = PageHead("report", figures.title, request.build);
  figures.root["rule"] = ToString(request.rule);
  figures.root["across"] = AcrossJson(request, pages);
  figures.root["datasets"] = Json::array();
  figures.root["experiments"] = Json::array();
  for (PageExperiment& page : pages) {
    page.json["dataset_index"] = nullptr;
    figures.root["experiments"].push_back(std::move(page.json));
  }
  return figures;
}

std::vector<PageGeometry> AddDatasets(const std::vector<ProblemIds>& problems, PageFigures* figures) {
  struct Shown {
    std::shared_ptr<const Dataset> dataset;
    ProblemIds problems;
    std::size_t index = 0;
  };
  std::map<std::string, Shown> shown;
  for (std::size_t i = 0; i < figures->datasets.size(); ++i) {
    if (!figures->datasets[i]) continue;
    Shown& one =
        shown.try_emplace(figures->datasets[i]->content_hash(), Shown{nullptr, {}, shown.size()}).first->second;
    one.dataset = figures->datasets[i];
    for (const TaskDescription& task : kTasks) {
      one.problems[task.task].insert(problems[i][task.task].begin(), problems[i][task.task].end());
    }
    figures->root["experiments"][i]["dataset_index"] = one.index;
  }
  std::vector<PageGeometry> blocks(shown.size());
  figures->root["datasets"] = Json::array();
  for (std::size_t i = 0; i < shown.size(); ++i) figures->root["datasets"].push_back(nullptr);
  for (auto& [hash, one] : shown) {
    const std::string block = "geometry-" + hash.substr(0, kShownHash);
    PageDataset described = DescribeDataset(*one.dataset, one.problems, block);
    figures->root["datasets"][one.index] = std::move(described.json);
    blocks[one.index] = {block, std::move(described.geometry)};
  }
  return blocks;
}

}  // namespace legopt::client
