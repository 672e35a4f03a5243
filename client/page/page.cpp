#include "client/page/page.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "client/client_error.h"
#include "client/page/page_dataset.h"
#include "client/page/page_file.h"
#include "client/page/page_playback.h"
#include "client/page/page_solutions.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 2;
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
                     std::to_string(reported) + " runs");
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
  std::optional<Rule> weakest;
  for (const PageSource& place : sources) {
    const auto source = OpenResults(place.source);
    if (!place.experiment && !HasExperiments(*source)) continue;
    const Rule rule = FindExperiment(*source, place.experiment).rule;
    weakest = std::min(weakest.value_or(rule), rule);
  }
  return weakest.value_or(Rule::kSolid);
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

namespace {

constexpr std::size_t kChunk = 400'000;  // bytes before compression; the page reads a chunk at once

// Adds the solutions of an experiment as long as they fit.
class SolutionWriter {
 public:
  SolutionWriter(std::size_t most_bytes, std::function<void(const std::string&)> tell, PageFile* file)
      : most_bytes_(most_bytes), tell_(std::move(tell)), file_(file) {}

  void Write(ResultSource& source, const std::vector<PageJob>& jobs, WaypointInspector* lister) {
    std::size_t done = 0;
    for (const PageJob& job : jobs) {
      if (full_) {
        ++left_out_;
        continue;
      }
      chunk_.Add(job, ReadPageMotion(source, job), TraceJson(source, job.job_id), lister, DepthInReport(job));
      if (++done % 100 == 0 && tell_) {
        tell_(std::to_string(done) + " of " + std::to_string(jobs.size()) + " solutions judged");
      }
      if (chunk_.weight() > kChunk) Flush();
    }
    Flush();
  }

  const Json& index() const { return index_; }        // value of "chunks"
  std::size_t left_out() const { return left_out_; }  // number of solutions that did not fit

 private:
  static FindingDepth DepthInReport(const PageJob& job) {
    const bool quick = !DescriptionOf(job.task).windowed;
    return quick || !job.solved ? FindingDepth::kWaypoints : FindingDepth::kNone;
  }

  void Flush() {
    if (chunk_.empty()) return;
    PageFile before = *file_;
    const std::string name = std::to_string(index_.size());
    Json jobs = Json::array();
    for (const auto& solution : chunk_.json()) jobs.push_back({solution.at("experiment"), solution.at("job")});
    const std::size_t index_bytes = index_bytes_ + Dump(jobs).size();  // upper bound: it will be compressed
    file_->AddBlock("motion-" + name, chunk_.bytes());
    file_->AddJson("solutions-" + name, chunk_.json());
    if (file_->size() + index_bytes > most_bytes_) {  // stop at the first chunk that does not fit
      *file_ = std::move(before);
      full_ = true;
      left_out_ += chunk_.json().size();
    } else {
      index_bytes_ = index_bytes;
      index_.push_back(std::move(jobs));
    }
    chunk_ = {};
  }

  std::size_t most_bytes_;
  std::function<void(const std::string&)> tell_;
  PageFile* file_;
  SolutionChunk chunk_;
  Json index_ = Json::array();
  std::size_t index_bytes_ = 0;
  std::size_t left_out_ = 0;
  bool full_ = false;
};

}  // namespace

Page MakeReport(const ReportRequest& request) {
  PageFigures figures = ReadFigures(request);
  std::vector<std::vector<PageJob>> jobs(figures.experiments.size());
  std::vector<ProblemIds> problems(figures.experiments.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!figures.datasets[i]) continue;
    jobs[i] =
        JobsWithSolutions(*figures.sources[i], figures.experiments[i].experiment.info.id, request.rule, request.filter);
    for (PageJob& job : jobs[i]) {
      job.experiment = i;
      problems[i][job.task].insert(job.problem);
    }
  }
  if (!request.home.empty()) figures.root["home"] = request.home;
  PageFile file("legopt: " + figures.title);
  for (const PageGeometry& block : AddDatasets(problems, &figures)) file.AddBlock(block.block, block.bytes);
  // Reserve space for the figures, which are written last, with the notes; a page without them would be useless.
  PageFile alone = file;
  alone.AddJson("page", figures.root);
  if (alone.size() > request.most_bytes) {
    throw ClientError(ExitCode::kUsage, "--max-size: the tables, robots and scenes alone take " +
                                            std::to_string(alone.size()) + " bytes; allow more");
  }
  constexpr std::size_t kSpare = 4096;  // space for notes
  const std::size_t reserved = std::min(alone.size() - file.size() + kSpare, request.most_bytes);
  SolutionWriter writer(request.most_bytes - reserved, request.tell, &file);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!figures.datasets[i]) continue;
    WaypointInspector lister(figures.datasets[i]);
    writer.Write(*figures.sources[i], jobs[i], &lister);
  }
  if (writer.left_out() > 0) {
    figures.notes.push_back(std::to_string(writer.left_out()) +
                            " solutions are left out, as they do not fit into --max-size; 'legopt view JOB' draws any");
  }
  figures.root["chunks"] = writer.index();
  figures.root["notes"] = figures.notes;
  file.AddJson("page", figures.root);
  return {file.Finish(), figures.notes};
}

ViewedJob ReadViewedJob(ResultSource& source, std::int64_t id) {
  const std::string name = "job " + std::to_string(id);
  const Listing row = source.Query(db::Sql(db::Query::kViewedJob, {{"job_id", id}}));
  if (row.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no " + name + "; 'legopt list' lists them");
  }
  if (row.At(0, "waypoints").get<int>() == 0 && row.At(0, "traced").get<int>() == 0) {
    throw ClientError(ExitCode::kUsage,
                      name + " has no solution to draw (" + row.Text(0, "state") + "); 'legopt view --problem " +
                          std::to_string(row.At(0, "problem").get<int>()) + " --tasks " + row.Text(0, "task") +
                          "' draws its problem, 'legopt show " + std::to_string(id) + " --logs' says why");
  }
  ViewedJob viewed;
  viewed.job = {.experiment = 0,
                .job_id = id,
                .method_id = 0,
                .task = row.EnumAt<Task>(0, "task"),
                .problem = row.At(0, "problem").get<int>(),
                .solved = false,
                .failed_waypoint = {}};
  if (!row.At(0, "failed_waypoint").is_null()) viewed.job.failed_waypoint = row.At(0, "failed_waypoint").get<int>();
  viewed.dataset_name = row.Text(0, "dataset");
  viewed.dataset_hash = row.Text(0, "dataset_hash");
  viewed.json = ListingToJson(row).at(0);
  viewed.json["job"] = id;
  return viewed;
}

namespace {

void RequireDataset(const ViewedJob& viewed, const Dataset& dataset) {
  if (viewed.dataset_hash == dataset.content_hash()) return;
  throw ClientError(ExitCode::kDatasetMismatch,
                    "job " + std::to_string(viewed.job.job_id) + " was solved on the dataset '" + viewed.dataset_name +
                        "' of hash " + viewed.dataset_hash + ", but " + dataset.folder().string() + " has hash " +
                        dataset.content_hash() + "; name the right folder with --dataset");
}

void AddViewedJobs(const ViewRequest& request, PageFile* file, Json* root, ProblemIds* problems, std::string* title) {
  const auto source = OpenResults(request.source);
  std::vector<ViewedJob> viewed = {ReadViewedJob(*source, *request.job)};
  if (request.ghost) viewed.push_back(ReadViewedJob(*source, *request.ghost));
  WaypointInspector lister(request.dataset);
  SolutionChunk chunk;
  Json jobs = Json::array(), index = Json::array();
  for (const ViewedJob& one : viewed) {
    RequireDataset(one, *request.dataset);
    if (one.job.task != viewed[0].job.task || one.job.problem != viewed[0].job.problem) {
      throw ClientError(ExitCode::kUsage, "--ghost: job " + std::to_string(one.job.job_id) +
                                              " solves another problem than job " + std::to_string(*request.job));
    }
    const PageMotion motion = ReadPageMotion(*source, one.job);
    chunk.Add(one.job, motion, TraceJson(*source, one.job.job_id), &lister, FindingDepth::kBetween);
    if (DescriptionOf(one.job.task).windowed) {
      file->AddJson(PlaybackName(one.job.job_id), PlaybackJson(*request.dataset, one.job, motion));
    }
    (*problems)[one.job.task].insert(one.job.problem);
    jobs.push_back(one.json);
    index.push_back({0, one.job.job_id});
  }
  file->AddBlock("motion-0", chunk.bytes());
  file->AddJson("solutions-0", chunk.json());
  (*root)["jobs"] = jobs;
  (*root)["chunks"] = Json::array({index});
  *title = "job " + std::to_string(*request.job);
}

}  // namespace

Page MakeView(const ViewRequest& request) {
  std::string title;
  ProblemIds problems;
  PageFile file(request.job ? "legopt: job " + std::to_string(*request.job) : "legopt: problem");
  Json root = PageHead("view", "", request.build);
  if (request.job) {
    AddViewedJobs(request, &file, &root, &problems, &title);
  } else {
    request.dataset->problem(request.task, request.problem.value_or(0));
    problems[request.task].insert(request.problem.value_or(0));
    title = std::string(ToString(request.task)) + " problem " + std::to_string(request.problem.value_or(0));
    root["jobs"] = Json::array();
    root["chunks"] = Json::array();
    root["problem"] = {{"task", ToString(request.task)}, {"id", request.problem.value_or(0)}};
  }
  PageDataset described = DescribeDataset(*request.dataset, problems, "geometry-0");
  file.AddBlock("geometry-0", described.geometry);
  root["title"] = title;
  root["datasets"] = Json::array({described.json});
  root["notes"] = Json::array();
  file.AddJson("page", root);
  return {file.Finish(), {}};
}

}  // namespace legopt::client
