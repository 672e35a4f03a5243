#include "client/service/experiment_status.h"

#include <nlohmann/json.hpp>
#include <tuple>

#include "client/client_error.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::json;

std::optional<double> OptionalNumber(const Json& entry, const char* key) {
  const auto found = entry.find(key);
  return found == entry.end() || found->is_null() ? std::nullopt : std::optional(found->get<double>());
}

ClientError NotUnderstood(const std::string& what) {
  return ClientError(ExitCode::kInternal, "the server's status is not understood: " + what +
                                              "; check that server and client are of the same version");
}

template <NamedEnum Enum>
Enum ReadEnum(const Json& word, const char* what) {
  const auto text = word.get<std::string>();
  if (const auto value = ParseEnum<Enum>(text)) return *value;
  throw NotUnderstood("unknown " + std::string(what) + " '" + text + "'");
}

// Older servers do not send these members.
void ReadSchedulingState(const Json& entry, ExperimentStatus* status) {
  if (const auto hold = entry.find("hold"); hold != entry.end()) status->hold = ReadEnum<ExperimentHold>(*hold, "hold");
  status->hold_reason = entry.value("hold_reason", "");
  status->priority = entry.value("priority", 0);
  if (const auto builds = entry.find("builds"); builds != entry.end()) {
    status->builds = ReadEnum<BuildPolicy>(*builds, "rule of builds");
  }
  status->build_id = entry.value("build_id", "");
  status->submitter = entry.value("submitter", "");
  status->dataset = entry.value("dataset", "");
  status->methods = entry.value("methods", std::vector<std::string>{});
  status->tags = entry.value("tags", std::vector<std::string>{});
  status->taken_over = entry.value("taken_over", std::int64_t{0});
  status->share = OptionalNumber(entry, "share").value_or(0);
  status->eta_s = OptionalNumber(entry, "eta_s");
  status->waiting_for = entry.value("waiting_for", "");
  status->missing = entry.value("missing", std::vector<std::string>{});
  status->spec_hash = entry.value("spec_hash", "");
  status->submitted_at_us = entry.value("submitted_at_us", std::int64_t{0});
  status->elapsed_s = OptionalNumber(entry, "elapsed_s").value_or(0);
  status->worked_s = OptionalNumber(entry, "worked_s");
}

ExperimentStatus ParseExperiment(const Json& entry) {
  const Json& jobs = entry.at("jobs");
  const auto count = [&jobs](const char* key) { return jobs.at(key).get<std::int64_t>(); };
  ExperimentStatus status;
  status.id = entry.at("id").get<std::int64_t>();
  status.name = entry.at("name").get<std::string>();
  status.state = ReadEnum<ExperimentState>(entry.at("state"), "state");
  status.total = count("total");
  status.queued = count("queued");
  status.leased = count("leased");
  status.done = count("done");
  status.failed = count("failed");
  status.dead = count("dead");
  status.cancelled = count("cancelled");
  status.rule = ReadEnum<Rule>(entry.at("rule"), "rule");
  status.solved = entry.at("solved").get<std::int64_t>();
  for (const Json& job : entry.value("running", Json::array())) {
    status.running.push_back({job.at("job").get<std::int64_t>(), ReadEnum<Task>(job.at("task"), "task"),
                              job.at("worker").get<std::int64_t>(), job.at("progress_done").get<std::int64_t>(),
                              job.at("progress_total").get<std::int64_t>()});
  }
  ReadSchedulingState(entry, &status);
  return status;
}

}  // namespace

std::vector<ExperimentStatus> ParseExperiments(const nlohmann::json& status) {
  std::vector<ExperimentStatus> experiments;
  try {
    for (const auto& entry : status.at("experiments")) experiments.push_back(ParseExperiment(entry));
  } catch (const nlohmann::json::exception& error) {
    throw NotUnderstood(error.what());
  }
  return experiments;
}

bool SameProgress(const ExperimentStatus& a, const ExperimentStatus& b) {
  const auto facts = [](const ExperimentStatus& s) {
    return std::tie(s.id, s.state, s.total, s.queued, s.leased, s.done, s.failed, s.dead, s.cancelled, s.solved,
                    s.taken_over, s.hold, s.hold_reason, s.priority, s.running, s.waiting_for);
  };
  return facts(a) == facts(b);
}

std::string StateText(const ExperimentStatus& status) {
  if (status.over() || status.hold == ExperimentHold::kNone) return std::string(ToString(status.state));
  return std::string(ToString(status.hold)) + (status.hold_reason.empty() ? "" : ": " + status.hold_reason);
}

std::string StoreError(const nlohmann::json& status) {
  return status.value(nlohmann::json::json_pointer("/server/store_error"), std::string());
}

nlohmann::json ParseStatusText(const std::string& text) {
  if (auto status = TryParseJson(text)) return *std::move(status);
  throw ClientError(ExitCode::kInternal,
                    "the server's status is not JSON; check that server and client are of the same version");
}

}  // namespace legopt::client
