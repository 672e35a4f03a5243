#include "client/serve/monitoring.h"

#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/client_error.h"
#include "client/service/experiment_status.h"
#include "client/service/server_connection.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

using nlohmann::json;

constexpr unsigned kUnavailable = 503;
constexpr double kServerPatience_s = 5;

// Writes metrics in the text format: HELP and TYPE once, then the samples.
class MetricsWriter {
 public:
  void Begin(const std::string& name, const char* type, const char* help) {
    name_ = "legopt_" + name;
    text_ += "# HELP " + name_ + " " + help + "\n# TYPE " + name_ + " " + type + "\n";
  }
  // Writes nothing for unknown values.
  void Sample(const json& value, const std::vector<std::pair<std::string, std::string>>& labels = {}) {
    if (!value.is_number() && !value.is_boolean()) return;
    text_ += name_;
    std::string list;
    for (const auto& [label, content] : labels)
      list += (list.empty() ? "{" : ",") + label + "=\"" + Escaped(content) + "\"";
    text_ += list + (list.empty() ? " " : "} ") + (value.is_boolean() ? (value.get<bool>() ? "1" : "0") : Dump(value)) +
             "\n";
  }
  void Figure(const std::string& name, const char* type, const char* help, const json& value) {
    if (!value.is_number() && !value.is_boolean()) return;
    Begin(name, type, help);
    Sample(value);
  }
  const std::string& text() const { return text_; }

 private:
  static std::string Escaped(const std::string& content) {
    std::string escaped;
    for (const char c : content) {
      if (c == '\\' || c == '"') escaped += '\\';
      escaped += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    return escaped;
  }

  std::string name_, text_;
};

json Member(const json& object, const char* key) { return object.is_object() ? object.value(key, json()) : json(); }

void WriteJobs(const json& status, MetricsWriter& metrics) {
  std::map<std::string, std::int64_t> jobs;
  std::map<std::string, std::int64_t> experiments;
  for (const auto& experiment : Member(status, "experiments")) {
    ++experiments[experiment.value("state", "")];
    for (const auto& [state, word] : kEnumNames<JobState>) {
      jobs[std::string(word)] += experiment.at("jobs").value(std::string(word), std::int64_t{0});
    }
  }
  metrics.Begin("jobs", "gauge", "Number of jobs by state.");
  for (const auto& [state, word] : kEnumNames<JobState>) {
    metrics.Sample(jobs[std::string(word)], {{"state", std::string(word)}});
  }
  metrics.Begin("experiments", "gauge", "Number of experiments by state.");
  for (const auto& [state, word] : kEnumNames<ExperimentState>) {
    metrics.Sample(experiments[std::string(word)], {{"state", std::string(word)}});
  }
  metrics.Begin("experiment_waits", "gauge", "1 while an active experiment stands still.");
  for (const auto& experiment : Member(status, "experiments")) {
    if (experiment.value("state", "") != "active") continue;
    metrics.Sample(!experiment.value("waiting_for", "").empty(), {{"experiment", Dump(experiment.at("id"))}});
  }
}

void WriteWorkers(const json& status, MetricsWriter& metrics) {
  const json workers = Member(status, "workers");
  const auto labels = [](const json& worker) {
    return std::vector<std::pair<std::string, std::string>>{{"worker", Dump(worker.at("id"))},
                                                            {"name", worker.value("name", "")}};
  };
  metrics.Begin("worker_online", "gauge", "1 while the worker is connected.");
  for (const auto& worker : workers) metrics.Sample(Member(worker, "online"), labels(worker));
  metrics.Begin("worker_heartbeat_age_seconds", "gauge", "Time since the worker was heard last.");
  for (const auto& worker : workers) metrics.Sample(Member(worker, "silent_s"), labels(worker));
  metrics.Begin("worker_leases", "gauge", "Number of jobs leased to the worker.");
  for (const auto& worker : workers) metrics.Sample(Member(worker, "leases"), labels(worker));
}

void WriteServer(const json& server, MetricsWriter& metrics) {
  metrics.Figure("uptime_seconds", "gauge", "Time since the server started.", Member(server, "uptime_s"));
  metrics.Figure("oldest_lease_age_seconds", "gauge", "Age of the oldest lease.", Member(server, "oldest_lease_s"));
  metrics.Figure("commits_total", "counter", "Number of commits to the database.", Member(server, "commits"));
  metrics.Figure("commit_seconds_total", "counter", "Time spent in commits.", Member(server, "commit_s"));
  metrics.Figure("longest_commit_seconds", "gauge", "Longest commit since the server started.",
                 Member(server, "longest_commit_s"));
  metrics.Figure("disk_free_bytes", "gauge", "Free bytes where the database is.", Member(server, "disk_free_bytes"));
  metrics.Figure("disk_bytes", "gauge", "Size of the file system with the database.", Member(server, "disk_bytes"));
  metrics.Figure("disk_low", "gauge", "1 while the disk with the database is nearly full.", Member(server, "disk_low"));
  const json error = Member(server, "store_error");
  if (error.is_string()) {
    metrics.Figure("store_error", "gauge", "1 while the database cannot be written.",
                   json(!error.get_ref<const std::string&>().empty()));
  }
  metrics.Begin("scheduler_total", "counter", "Totals since the server started.");
  const json scheduler = Member(server, "scheduler");
  const json transport = Member(server, "transport");
  for (const auto& [name, value] : scheduler.items()) metrics.Sample(value, {{"what", name}});
  metrics.Begin("requests_total", "counter", "Requests received, by type.");
  const json requests = Member(server, "requests");
  for (const auto& [type, count] : requests.items()) {
    metrics.Sample(Member(count, "requests"), {{"type", type}});
  }
  metrics.Begin("rejected_datagrams_total", "counter", "Datagrams rejected, by cause.");
  for (const auto& [name, value] : transport.items()) {
    constexpr std::string_view kRejected = "rejected_";
    if (name.starts_with(kRejected)) metrics.Sample(value, {{"cause", name.substr(kRejected.size())}});
  }
}

// Returns a status reply with the information available in a file.
json StatusOfFile(const SourceOptions& source) {
  const auto results = OpenResults(source);
  const Listing rows = results->Query(db::Sql(db::Query::kExperimentStates));
  json experiments = json::array();
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    json jobs = json::object();
    for (const auto& [state, word] : kEnumNames<JobState>)
      jobs[std::string(word)] = rows.At(i, std::string(word).c_str());
    experiments.push_back({{"id", rows.At(i, "experiment_id")},
                           {"state", rows.At(i, "state")},
                           {"waiting_for", ""},
                           {"jobs", std::move(jobs)}});
  }
  return {{"experiments", std::move(experiments)}};
}

}  // namespace

std::string MetricsText(const json& status) {
  MetricsWriter metrics;
  WriteJobs(status, metrics);
  if (status.contains("workers")) WriteWorkers(status, metrics);
  if (status.contains("server")) WriteServer(status.at("server"), metrics);
  return metrics.text();
}

std::string HealthFault(const json& status) {
  const std::string error = StoreError(status);
  return error.empty() ? std::string() : "the server cannot write its database: " + error;
}

json Monitoring::Status() const {
  if (source_.db) return StatusOfFile(source_);
  NetworkOptions network = source_.network;
  network.timeout_s = std::min(network.timeout_s, kServerPatience_s);
  return ServerConnection(network).Status(0);
}

HttpReply Monitoring::Answer(const HttpRequest& request) const {
  const bool health = request.path == "/healthz";
  json status;
  try {
    status = Status();
  } catch (const ClientError& error) {
    return TextReply(kUnavailable, error.what());
  }
  if (health) {
    const std::string fault = HealthFault(status);
    return fault.empty() ? TextReply(200, "ok") : TextReply(kUnavailable, fault);
  }
  HttpReply reply;
  reply.type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body = std::make_shared<const std::string>(MetricsText(status));
  return reply;
}

}  // namespace legopt::client
