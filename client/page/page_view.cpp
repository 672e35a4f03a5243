#include "client/page/page_view.h"

#include "client/client_error.h"
#include "client/page/page_dataset.h"
#include "client/page/page_file.h"
#include "db/named_queries.h"

namespace legopt::client {

namespace {

using Json = nlohmann::ordered_json;

}  // namespace

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
    chunk.Add(one.job, ReadPageMotion(*source, one.job), TraceJson(*source, one.job.job_id), &lister,
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
