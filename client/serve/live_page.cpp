#include "client/serve/live_page.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <exception>
#include <filesystem>

#include "client/client_error.h"
#include "client/page/page.h"
#include "client/page/page_file.h"
#include "client/page/page_playback.h"
#include "client/service/experiment_status.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr unsigned kNotFound = 404, kBadRequest = 400, kBusy = 503;
constexpr std::size_t kMaxKeptBytes = 64U << 20U;
constexpr std::size_t kMaxExperiments = 8;
constexpr std::size_t kMaxFigures = 8;                // number of cached sets of experiments
constexpr std::chrono::seconds kShortestInterval{5};  // minimum time between two computations of the same figures
constexpr int kIntervalPerWork = 10;                  // minimum time as a multiple of the computing time
constexpr char kBlocks[] = "/blocks/", kMotion[] = "motion-", kSolutions[] = "solutions-", kPlayback[] = "playback-";

std::optional<std::int64_t> EnumNumber(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 1) return std::nullopt;
  return number;
}

HttpReply Static(const std::string& type, std::string text, std::string etag) {
  HttpReply reply;
  reply.type = type;
  reply.body = std::make_shared<const std::string>(std::move(text));
  reply.etag = std::move(etag);
  return reply;
}

// Returns the number of ended jobs per experiment: figures change with it.
std::string ProgressOf(ResultSource& source, const std::vector<PageSource>& shown) {
  std::vector<std::int64_t> experiments;
  for (const PageSource& one : shown) {
    if (one.experiment) experiments.push_back(*one.experiment);
  }
  const Listing row = source.Query(
      db::Sql(db::Query::kExperimentProgress, {{"experiment_ids", experiments}, {"newest", experiments.empty()}}));
  return row.Text(0, "progress");
}

// Returns all problems of an experiment, solved or not.
ProblemIds ProblemsOf(ResultSource& source, std::int64_t experiment) {
  const Listing rows = source.Query(db::Sql(db::Query::kProblemsOfExperiment, {{"experiment_id", experiment}}));
  ProblemIds problems;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    problems[rows.EnumAt<Task>(i, "task")].insert(rows.At(i, "problem").get<int>());
  }
  return problems;
}

}  // namespace

LiveBlocks::LiveBlocks(FigureRequest request, std::optional<Rule> rule)
    : request_(std::move(request)),
      rule_(rule),
      start_(std::to_string(std::chrono::system_clock::now().time_since_epoch().count())),
      source_(OpenResults(request_.sources.front().source)) {}

std::optional<HttpReply> LiveBlocks::TryAnswer(const HttpRequest& request) {
  if (request.path == "/") return Static("text/html; charset=utf-8", LivePageText(), start_);
  if (request.path == "/page.js") {
    return Static("text/javascript; charset=utf-8", std::string(PageProgram()), start_);
  }
  if (!request.path.starts_with(kBlocks)) return TextReply(kNotFound, "there is nothing of this name");
  const std::lock_guard lock(kept_mutex_);
  const auto kept = kept_.find(request.path.substr(sizeof(kBlocks) - 1));
  if (kept == kept_.end()) return std::nullopt;
  return kept->second;
}

HttpReply LiveBlocks::Make(const HttpRequest& request) {
  const std::string block = request.path.substr(std::min(sizeof(kBlocks) - 1, request.path.size()));
  try {
    if (block == "page") return MakeFigures(request.experiment);
    for (const std::string prefix : {kMotion, kSolutions, kPlayback}) {
      if (!block.starts_with(prefix)) continue;
      const auto job = EnumNumber(std::string_view(block).substr(prefix.size()));
      if (job) return prefix == kPlayback ? MakePlayback(block, *job) : MakeSolution(block, *job);
    }
  } catch (const ClientError& error) {
    if (error.code() == ExitCode::kUsage) return TextReply(kNotFound, error.what());
    throw;
  }
  // Geometry is created with the figures, which a page requests first.
  return TextReply(kNotFound, "there is no block '" + block + "'");
}

std::vector<PageSource> LiveBlocks::SourcesOf(const std::string& experiments) const {
  if (experiments.empty()) return request_.sources;
  std::vector<PageSource> sources;
  for (std::size_t begin = 0; begin <= experiments.size();) {
    const std::size_t end = std::min(experiments.find(',', begin), experiments.size());
    const auto id = EnumNumber(std::string_view(experiments).substr(begin, end - begin));
    if (!id) return {};
    sources.push_back({request_.sources.front().source, *id});
    begin = end + 1;
  }
  if (sources.size() > kMaxExperiments) return {};
  return sources;
}

HttpReply LiveBlocks::MakeFigures(const std::string& experiments) {
  FigureRequest request = request_;
  request.sources = SourcesOf(experiments);
  if (request.sources.empty()) {
    return TextReply(kBadRequest, "experiment: at most " + std::to_string(kMaxExperiments) +
                                      " numbers of experiments with commas between them");
  }
  const std::lock_guard lock(figures_mutex_);
  const auto progress_source = OpenResults(request.sources.front().source);
  const std::string progress = ProgressOf(*progress_source, request.sources);
  const auto begin = Clock::now();
  if (const auto made = figures_.find(experiments); made != figures_.end()) {
    const Figures& known = made->second;
    const auto interval = std::max<Clock::duration>(kShortestInterval, kIntervalPerWork * known.took);
    if (known.progress == progress || begin - known.made < interval) return known.reply;
  }
  request.rule = PageRule(request.sources, rule_);
  PageFigures figures = ReadFigures(request);
  std::vector<ProblemIds> problems;
  for (std::size_t i = 0; i < figures.experiments.size(); ++i) {
    problems.push_back(ProblemsOf(*figures.sources[i], figures.experiments[i].experiment.info.id));
  }
  for (const PageGeometry& geometry : AddDatasets(problems, &figures)) Keep(geometry.block, geometry.bytes);
  figures.root["chunks"] = Json::array();
  figures.root["notes"] = figures.notes;
  Figures made;
  made.reply = BlockReply(Dump(figures.root));
  made.progress = progress;
  made.made = Clock::now();
  made.took = made.made - begin;
  if (figures_.size() >= kMaxFigures) figures_.erase(figures_.begin());
  return figures_.insert_or_assign(experiments, std::move(made)).first->second.reply;
}

HttpReply LiveBlocks::MakeSolution(const std::string& block, std::int64_t job) {
  const std::lock_guard lock(solutions_mutex_);
  if (const auto known = TryAnswer({kBlocks + block, ""}))
    return *known;  // the page requests both blocks of a solution
                    // at once
  const ViewedJob viewed = ReadViewedJob(*source_, job);
  const auto dataset = DatasetOf(viewed);
  if (!dataset) return TextReply(kNotFound, "the dataset of job " + std::to_string(job) + " was not found");
  auto& lister = listers_[viewed.dataset_hash];
  if (!lister) lister = std::make_unique<WaypointInspector>(dataset);
  SolutionChunk chunk;
  chunk.Add(viewed.job, ReadPageMotion(*source_, viewed.job), TraceJson(*source_, job), lister.get(),
            FindingDepth::kBetween);
  const HttpReply motion = Keep(kMotion + std::to_string(job), chunk.bytes());
  const HttpReply solutions = Keep(kSolutions + std::to_string(job), Dump(chunk.json()));
  return block.starts_with(kMotion) ? motion : solutions;
}

std::shared_ptr<const Dataset> LiveBlocks::DatasetOf(const ViewedJob& viewed) const {
  const auto found = std::ranges::find(request_.datasets, viewed.dataset_hash,
                                       [](const auto& dataset) { return dataset->content_hash(); });
  return found == request_.datasets.end() ? nullptr : *found;
}

HttpReply LiveBlocks::MakePlayback(const std::string& block, std::int64_t job) {
  // Waiting would take the thread that other requests need.
  const std::unique_lock computing(playback_mutex_, std::try_to_lock);
  if (!computing) return TextReply(kBusy, "the server computes another motion; ask again in a second");
  if (const auto known = TryAnswer({kBlocks + block, ""})) return *known;
  ViewedJob viewed;
  PageMotion motion;
  {
    const std::lock_guard reading(solutions_mutex_);
    viewed = ReadViewedJob(*source_, job);
    motion = ReadPageMotion(*source_, viewed.job);
  }
  const auto dataset = DatasetOf(viewed);
  if (!dataset) return TextReply(kNotFound, "the dataset of job " + std::to_string(job) + " was not found");
  if (!DescriptionOf(viewed.job.task).windowed) {
    return TextReply(kNotFound, "job " + std::to_string(job) + " is a posture, which has no duration");
  }
  return Keep(block, Dump(PlaybackJson(*dataset, viewed.job, motion)));
}

HttpReply LiveBlocks::BlockReply(const std::string& bytes) {
  std::string etag = start_ + "-";
  {
    const std::lock_guard lock(kept_mutex_);
    etag += std::to_string(++serial_);
  }
  return Static("application/octet-stream", Gzip(bytes), etag);
}

HttpReply LiveBlocks::Keep(const std::string& name, const std::string& bytes) {
  HttpReply reply = BlockReply(bytes);
  const std::lock_guard lock(kept_mutex_);
  if (const auto known = kept_.find(name); known != kept_.end()) {
    kept_bytes_ -= known->second.body->size();
    order_.remove(name);
  }
  kept_bytes_ += reply.body->size();
  order_.push_back(name);
  kept_[name] = reply;
  while (kept_bytes_ > kMaxKeptBytes && order_.size() > 1) {
    const auto oldest = kept_.find(order_.front());
    kept_bytes_ -= oldest->second.body->size();
    kept_.erase(oldest);
    order_.pop_front();
  }
  return reply;
}

namespace {

constexpr double kWindow_s = 60;
constexpr double kSecondsPerMinute = 60;
constexpr std::size_t kMaxFailures = 50;
constexpr int kMaxExamined = 10'000;  // newest results that are searched for failures, whatever the size of the file

Json ExperimentsOfServer(const nlohmann::json& status) {
  Json list = Json::array();
  for (const ExperimentStatus& e : ParseExperiments(status)) {
    list.push_back({{"id", e.id},
                    {"name", e.name},
                    {"state", StateText(e)},
                    {"jobs", e.total},
                    {"queued", e.queued},
                    {"leased", e.leased},
                    {"done", e.done},
                    {"failed", e.failed},
                    {"dead", e.dead},
                    {"cancelled", e.cancelled},
                    {"solved", e.solved},
                    {"waiting_for", e.waiting_for},
                    {"eta_s", e.eta_s ? Json(std::round(*e.eta_s)) : Json()}});
  }
  return list;
}

// Rounds the age, so that the text does not change without events; null for a worker with recent messages.
Json CoarseAge(const Json& silent_s) {
  constexpr double kUsual_s = 5, kMinute_s = 60;
  if (!silent_s.is_number() || silent_s.get<double>() < kUsual_s) return {};
  const double step_s = silent_s.get<double>() < kMinute_s ? kUsual_s : kMinute_s;
  return std::floor(silent_s.get<double>() / step_s) * step_s;
}

Json WorkersOfServer(const nlohmann::json& status) {
  Json list = Json::array();
  for (const auto& worker : status.value("workers", nlohmann::json::array())) {
    Json row;
    for (const char* member :
         {"id", "name", "hostname", "slots", "leases", "online", "draining", "silent_s", "load", "build_id"}) {
      row[member] = worker.contains(member) ? Json(worker.at(member)) : Json();
    }
    row["silent_s"] = CoarseAge(row.at("silent_s"));
    list.push_back(std::move(row));
  }
  return list;
}

Json RowsOf(const Listing& listing) {
  Json rows = Json::array();
  for (const auto& row : listing.rows) {
    Json json = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) json[listing.columns[i]] = Json(row[i]);
    rows.push_back(std::move(json));
  }
  return rows;
}

}  // namespace

LiveState::LiveState(const SourceOptions& source, Rule rule)
    : options_(source),
      rule_(rule),
      source_(OpenResults(source)),
      server_(source.db ? nullptr : std::make_unique<ServerConnection>(source.network)),
      text_(std::make_shared<const std::string>("{}")) {}

std::shared_ptr<const std::string> LiveState::text() const {
  const std::lock_guard lock(mutex_);
  return text_;
}

bool LiveState::Read(double now_s) {
  Json json;
  try {
    json = ReadAll(now_s);
  } catch (const std::exception& error) {
    json = ParseOrderedJson(*text(), "state of the page");
    json["error"] = error.what();
  }
  json.erase("version");
  Json before = ParseOrderedJson(*text(), "state of the page");
  before.erase("version");
  if (json == before) return false;
  json["version"] = ++version_;
  auto text = std::make_shared<const std::string>(Dump(json));
  const std::lock_guard lock(mutex_);
  text_ = std::move(text);
  return true;
}

Json LiveState::ReadAll(double now_s) {
  Json json = {{"source", options_.db ? std::filesystem::path(*options_.db).filename().string() : "the server"},
               {"rule", ToString(rule_)}};
  if (server_) {
    const auto status = server_->Status(0);
    json["experiments"] = ExperimentsOfServer(status);
    json["workers"] = WorkersOfServer(status);
    if (const std::string error = StoreError(status); !error.empty()) json["error"] = error;
  } else {
    json["experiments"] = ExperimentsOfFile();
    json["workers"] = WorkersOfFile();
  }
  AddRates(now_s, &json["experiments"]);
  ReadFailures();
  json["failures"] = failures_;
  json["events"] = ReadEvents();
  return json;
}

Json LiveState::ExperimentsOfFile() { return RowsOf(source_->Query(db::Sql(db::Query::kLiveExperiments))); }

// Returns the workers with running jobs; a file does not show whether other workers are online.
Json LiveState::WorkersOfFile() { return RowsOf(source_->Query(db::Sql(db::Query::kLiveWorkers))); }

void LiveState::ReadFailures() {
  const Listing rows = source_->Query(db::Sql(
      db::Query::kLiveFailures,
      {{"after_us", failures_until_us_}, {"rule", rule_}, {"examined", kMaxExamined}, {"limit", kMaxFailures}}));
  Json all = RowsOf(rows);
  if (all.empty()) return;
  failures_until_us_ = all.front().at("at_us").get<std::int64_t>();
  for (Json& old : failures_) {
    if (all.size() < kMaxFailures) all.push_back(std::move(old));
  }
  failures_ = std::move(all);
}

// Returns the newest events that may change a user's plans.
Json LiveState::ReadEvents() {
  constexpr int kMost = 20;
  return RowsOf(source_->Query(db::Sql(db::Query::kLiveEvents, {{"limit", kMost}})));
}

// Adds the rate of ended jobs over the last minute, or since the first call.
void LiveState::AddRates(double now_s, Json* experiments) {
  for (Json& experiment : *experiments) {
    std::int64_t finished = 0;
    for (const char* state : {"done", "failed", "dead", "cancelled"})
      finished += experiment.at(state).get<std::int64_t>();
    auto& samples = seen_[experiment.at("id").get<std::int64_t>()];
    samples.push_back({now_s, finished});
    while (samples.size() > 2 && samples[1].at_s <= now_s - kWindow_s) samples.pop_front();
    const double span_s = now_s - samples.front().at_s;
    const auto ended = static_cast<double>(finished - samples.front().finished);
    const double rate = span_s > 0 ? ended / span_s : 0;
    experiment["per_minute"] = std::round(rate * kSecondsPerMinute);
    const double left = experiment.at("queued").get<double>() + experiment.at("leased").get<double>();
    if (experiment.at("eta_s").is_null() && rate > 0 && left > 0) experiment["eta_s"] = std::round(left / rate);
  }
}

}  // namespace legopt::client
