#include "client/page/page_report.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "client/client_error.h"
#include "client/page/page_file.h"
#include "client/page/page_solutions.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

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

}  // namespace legopt::client
