#include "server/event_sinks.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "legopt/input/json.h"

namespace legopt::server {
namespace {

// The list in docs/how-to/monitoring.md.
constexpr std::array<std::string_view, 7> kForPeople = {
    "worker_lost", "job_dead", "job_failed", "jobs_refused", "disk_low", "no_progress", "experiment_finished"};

nlohmann::json JsonOf(const std::optional<std::int64_t>& id) { return id ? nlohmann::json(*id) : nlohmann::json(); }

std::string JsonOf(const db::RecordEvent& event) {
  return Dump(nlohmann::json{{"at_us", event.at_us},
                             {"kind", event.kind},
                             {"experiment", JsonOf(event.experiment_id)},
                             {"job", JsonOf(event.job_id)},
                             {"worker", JsonOf(event.worker_id)},
                             {"detail", event.detail}}) +
         "\n";
}

std::string LineOf(const db::RecordEvent& event) {
  std::string line = event.kind;
  if (event.experiment_id) line += ", experiment " + std::to_string(*event.experiment_id);
  if (event.job_id) line += ", job " + std::to_string(*event.job_id);
  if (event.worker_id) line += ", worker " + std::to_string(*event.worker_id);
  return event.detail.empty() ? line : line + ": " + event.detail;
}

}  // namespace

EventSinks::EventSinks(const std::optional<std::string>& command) {
  if (command) notifier_.emplace(*command);
}

void EventSinks::Take(const db::RecordEvent& event) {
  if (std::find(kForPeople.begin(), kForPeople.end(), event.kind) == kForPeople.end()) {
    spdlog::info("event: {}", LineOf(event));
    return;
  }
  spdlog::warn("event: {}", LineOf(event));
  if (notifier_) notifier_->Add(JsonOf(event));
}

void EventSinks::Work() {
  if (!notifier_) return;
  if (const std::string fault = notifier_->Work(); !fault.empty()) spdlog::warn(fault);
}

}  // namespace legopt::server
