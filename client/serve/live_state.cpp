#include "client/serve/live_state.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>

#include "client/service/experiment_status.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kWindow_s = 60;
constexpr double kSecondsPerMinute = 60;
constexpr std::size_t kMaxFailures = 50;

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
  const Listing rows = source_->Query(
      db::Sql(db::Query::kLiveFailures, {{"after_us", failures_until_us_}, {"rule", rule_}, {"limit", kMaxFailures}}));
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
