#include "client/page/page_report.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

#include "client/client_error.h"
#include "client/page/page_dataset.h"
#include "client/page/page_experiment.h"
#include "client/page/page_file.h"
#include "client/page/page_solutions.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kChunk = 400'000;  // bytes before compression: read by the page at once

std::string UtcNow() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M:%S", &parts);
  return text;
}

Json Head(const char* kind, const std::string& title, const programs::BuildFacts& build) {
  return {{"format", kFormat},
          {"kind", kind},
          {"title", title},
          {"written_utc", UtcNow()},
          {"legopt", {{"version", build.version}, {"build_id", programs::BuildId(build)}}}};
}

std::string PlaceOf(const SourceOptions& options) { return options.db ? *options.db : std::string("the server"); }

// A page travels: it names the file, not its folder.
std::string ShownPlace(const SourceOptions& options) {
  return options.db ? std::filesystem::path(*options.db).filename().string() : PlaceOf(options);
}

// Of everything that a page of one dataset may show.
ProblemIds ProblemsOfJobs(const std::vector<PageJob>& jobs) {
  ProblemIds problems;
  for (const PageJob& job : jobs) problems[job.task].insert(job.problem);
  return problems;
}

// Adds the solutions of one experiment while they fit.
class SolutionWriter {
 public:
  SolutionWriter(const ReportRequest& request, PageFile* file) : request_(request), file_(file) {}

  void Write(ResultSource& source, const std::vector<PageJob>& jobs, FindingLister* lister) {
    std::size_t done = 0;
    for (const PageJob& job : jobs) {
      if (full_) {
        ++left_out_[job.task];
        continue;
      }
      const bool quick = !DescriptionOf(job.task).windowed;
      const auto depth = quick || !job.solved ? FindingDepth::kWaypoints : FindingDepth::kNone;
      chunk_.Add(job, ReadWaypointsOf(source, job.job_id), TraceJson(source, job.job_id), lister, depth);
      if (++done % 100 == 0 && request_.tell) {
        request_.tell(std::to_string(done) + " of " + std::to_string(jobs.size()) + " solutions judged");
      }
      if (chunk_.weight() > kChunk) Flush();
    }
    Flush();
  }

  const Json& index() const { return index_; }
  const Per<Task, int>& left_out() const { return left_out_; }

 private:
  void Flush() {
    if (chunk_.empty()) return;
    PageFile before = *file_;
    const std::string name = std::to_string(index_.size());
    file_->AddBlock("motion-" + name, chunk_.bytes());
    file_->AddJson("solutions-" + name, chunk_.json());
    if (file_->size() > request_.most_bytes) {  // the last chunk that does not fit ends it
      *file_ = std::move(before);
      full_ = true;
      for (const auto& solution : chunk_.json()) lost_.push_back(solution.at("job").get<std::int64_t>());
    } else {
      Json jobs = Json::array();
      for (const auto& solution : chunk_.json()) jobs.push_back({solution.at("experiment"), solution.at("job")});
      index_.push_back(std::move(jobs));
    }
    chunk_ = {};
  }

 public:
  const std::vector<std::int64_t>& lost() const { return lost_; }  ///< jobs of the chunk that did not fit

 private:
  const ReportRequest& request_;
  PageFile* file_;
  SolutionChunk chunk_;
  Json index_ = Json::array();
  Per<Task, int> left_out_{};
  std::vector<std::int64_t> lost_;
  bool full_ = false;
};

// Experiments beside the first one, where they can be compared.
Json AcrossJson(const ReportRequest& request, const std::vector<PageExperiment>& pages) {
  Json list = Json::array();
  for (std::size_t i = 1; i < pages.size(); ++i) {
    Json json = {{"a", 0}, {"b", i}};
    ComparisonRequest comparison;
    const PageSource &a = request.sources[0], &b = request.sources[i];
    comparison.rule = request.rule;
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

}  // namespace

Page MakeReport(const ReportRequest& request) {
  std::vector<PageExperiment> pages;
  std::vector<std::unique_ptr<ResultSource>> sources;
  Page page;
  for (const PageSource& source : request.sources) {
    sources.push_back(OpenResults(source.source));
    pages.push_back(
        DescribeExperiment(*sources.back(), source.source, ShownPlace(source.source), source.experiment, request.rule));
    NoteState(pages.back(), &page.notes);
    if (request.tell) request.tell("figures of " + Named(pages.back()) + " computed");
  }
  const std::string title =
      pages.size() == 1 ? pages[0].experiment.info.name : std::to_string(pages.size()) + " experiments";
  Json root = Head("report", title, request.build);
  root["rule"] = ToString(request.rule);
  root["across"] = AcrossJson(request, pages);
  PageFile file("legopt: " + title);
  root["datasets"] = Json::array();
  root["experiments"] = Json::array();
  for (PageExperiment& described : pages) {
    described.json["dataset_index"] = nullptr;
    root["experiments"].push_back(described.json);
  }
  {
    // The figures come first: without them nothing else is worth its bytes. They are written last, with the notes.
    PageFile figures = file;
    figures.AddJson("page", root);
    const std::size_t figure_bytes = figures.size() - file.size();
    if (figures.size() > request.most_bytes) {
      throw ClientError(ExitCode::kUsage,
                        "--max-size: the tables alone take " + std::to_string(figures.size()) + " bytes; allow more");
    }
    ReportRequest rest = request;
    rest.most_bytes -= std::min(rest.most_bytes, figure_bytes + 4096);
    SolutionWriter writer(rest, &file);
    for (std::size_t i = 0; i < pages.size(); ++i) {
      const std::string& hash = pages[i].experiment.info.dataset_hash;
      const auto dataset =
          std::ranges::find_if(request.datasets, [&](const auto& d) { return d->content_hash() == hash; });
      if (dataset == request.datasets.end()) {
        page.notes.push_back(Named(pages[i]) + " ran on dataset '" + pages[i].experiment.info.dataset_name +
                             "' of hash " + hash + ", which is not at hand: no 3D; name its folder with --dataset");
        continue;
      }
      std::vector<PageJob> jobs = JobsWithSolutions(*sources[i], pages[i].experiment.info.id, request.rule);
      for (PageJob& job : jobs) job.experiment = i;
      const auto known = std::ranges::find_if(root["datasets"], [&](const Json& d) { return d.at("hash") == hash; });
      if (known == root["datasets"].end()) {
        const std::string block = "geometry-" + std::to_string(root["datasets"].size());
        PageDataset described = DescribeDataset(**dataset, ProblemsOfJobs(jobs), block);
        file.AddBlock(block, described.geometry);
        root["experiments"][i]["dataset_index"] = root["datasets"].size();
        root["datasets"].push_back(std::move(described.json));
      } else {
        root["experiments"][i]["dataset_index"] = known - root["datasets"].begin();
      }
      FindingLister lister(*dataset);
      writer.Write(*sources[i], jobs, &lister);
    }
    std::size_t lost = writer.lost().size();
    for (const TaskDescription& task : kTasks) lost += static_cast<std::size_t>(writer.left_out()[task.task]);
    if (lost > 0) {
      page.notes.push_back(std::to_string(lost) +
                           " solutions are left out, as they do not fit into --max-size; 'legopt view JOB' draws any");
    }
    root["chunks"] = writer.index();
  }
  root["notes"] = page.notes;
  file.AddJson("page", root);
  page.text = file.Finish();
  return page;
}

namespace {

struct ViewedJob {
  PageJob job;
  Json json;
  std::string dataset_name, dataset_hash;
};

ViewedJob ReadViewedJob(ResultSource& source, std::int64_t id) {
  const std::string name = "job " + std::to_string(id);
  const Listing row = source.Query(
      "SELECT c.experiment_id, e.name AS experiment, e.seed, c.task, c.initialization, p.problem_id AS problem, "
      "j.repetition, j.state, m.name AS method, m.hash AS method_hash, d.name AS dataset, d.hash AS dataset_hash, "
      "coalesce(w.build_id, '') AS build_id, r.solver_status AS status, r.verdict_literal AS literal, r.verdict_strict "
      "AS strict, r.verdict_solid AS solid, r.verdict_detail AS detail, r.failed_waypoint, r.cost, r.wall_us, "
      "r.cpu_us, r.iterations, r.restarts, (SELECT count(*) FROM waypoints AS x WHERE x.job_id = j.job_id) AS "
      "waypoints FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN experiments AS e USING (experiment_id) JOIN "
      "datasets AS d USING (dataset_id) JOIN methods AS m USING (method_id) JOIN problems AS p USING (problem_key) "
      "LEFT JOIN results AS r ON r.job_id = j.job_id LEFT JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = "
      "r.attempt LEFT JOIN workers AS w ON w.worker_id = a.worker_id WHERE j.job_id = " +
      std::to_string(id));
  if (row.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no " + name + "; 'legopt list" + source.flags() + "' lists them");
  }
  if (row.At(0, "waypoints").get<int>() == 0) {
    throw ClientError(ExitCode::kUsage, name + " has no solution to draw (" + row.Text(0, "state") + "); 'legopt view" +
                                            source.flags() + " --problem " +
                                            std::to_string(row.At(0, "problem").get<int>()) +
                                            "' draws its problem, 'legopt logs " + std::to_string(id) + "' tells why");
  }
  ViewedJob viewed;
  viewed.job = {.experiment = 0,
                .job_id = id,
                .method_id = 0,
                .task = row.WordAt<Task>(0, "task"),
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
  FindingLister lister(request.dataset);
  SolutionChunk chunk;
  Json jobs = Json::array(), index = Json::array();
  for (const ViewedJob& one : viewed) {
    RequireDataset(one, *request.dataset);
    if (one.job.task != viewed[0].job.task || one.job.problem != viewed[0].job.problem) {
      throw ClientError(ExitCode::kUsage, "--ghost: job " + std::to_string(one.job.job_id) +
                                              " solves another problem than job " + std::to_string(*request.job));
    }
    chunk.Add(one.job, ReadWaypointsOf(*source, one.job.job_id), TraceJson(*source, one.job.job_id), &lister,
              FindingDepth::kBetween);
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
  Json root = Head("view", "", request.build);
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
