#include "client/report/watching.h"

#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/report/progress.h"
#include "client/service/interrupt.h"

namespace legopt::client {
namespace {

// Short at first, so that a run of a second is not delayed by its progress display.
constexpr int kFirstInterval_ms = 50;
constexpr int kInterval_ms = 250;

Seconds Now() { return std::chrono::steady_clock::now().time_since_epoch(); }

}  // namespace

void StoreOutageMonitor::Look(const nlohmann::json& status, WatchView* view) {
  const std::string error = StoreError(status);
  const auto now = std::chrono::steady_clock::now();
  if (error.empty() != error_.empty()) {
    since_ = now;
    if (view != nullptr) view->Break();
    if (error.empty()) {
      std::fprintf(stderr, "legopt: the server writes its database again\n");
    } else {
      std::fprintf(
          stderr,
          "legopt: warning: the server cannot write its database: %s. Nothing is lost: it continues as soon as "
          "it can\n",
          app::Printable(error).c_str());
    }
  }
  error_ = error;
  if (now - since_ > kPatience) ThrowIfAny();
}

void StoreOutageMonitor::ThrowIfAny() const {
  if (error_.empty()) return;
  throw ClientError(ExitCode::kDatabaseUnusable, "the server cannot write its database: " + error_ +
                                                     ". Acknowledged results are kept; once it can write again, the "
                                                     "same command continues");
}

void ServerPatience::Answered(Seconds now, WatchView& view) {
  answered_ = now;
  if (std::exchange(silent_, false)) view.ServerBack();
}

void ServerPatience::Silent(Seconds now, const ClientError& error, WatchView& view) {
  if (!answered_) throw error;
  const Seconds silence = now - *answered_;
  if (silence >= patience_) {
    throw ClientError(ExitCode::kUnreachable, "the server has not answered for " + FormatDuration(silence) +
                                                  ". Acknowledged results are in its database; 'legopt "
                                                  "watch' continues when it is back");
  }
  if (!std::exchange(silent_, true)) view.ServerSilent(silence, patience_);
}

void StallTimeout::Look(Seconds now, const ExperimentStatus& status) {
  const bool moves = status.over() || status.waiting_for.empty() || status.finished() != finished_;
  finished_ = status.finished();
  if (moves || !moved_) moved_ = now;
  if (!give_up_ || now - *moved_ < *give_up_) return;
  const std::string id = std::to_string(status.id);
  throw ClientError(ExitCode::kNoProgress, "experiment " + id + " has not moved for " + FormatDuration(now - *moved_) +
                                               ": " + status.waiting_for + ". It stays as it is; 'legopt watch " + id +
                                               "' returns to it, 'legopt cancel " + id + "' ends it");
}

ExperimentStatus WatchedExperiment::Find(const nlohmann::json& reply) {
  const auto refuse = [this](const std::string& what) {
    return ClientError(ExitCode::kDatabaseUnusable,
                       "the server at " + address_ + " came back with another database: " + what +
                           ". Start the server with the database of before ('legopt status' shows which it has)");
  };
  const std::string name = "experiment " + std::to_string(id_);
  for (ExperimentStatus& status : ParseExperiments(reply)) {
    if (status.id != id_) continue;
    const std::pair identity(status.spec_hash, status.submitted_at_us);
    if (identity_ && *identity_ != identity) throw refuse(name + " ('" + status.name + "') is another one there");
    identity_ = identity;
    return std::move(status);
  }
  if (identity_) throw refuse("there is no " + name);
  throw ClientError(ExitCode::kUsage,
                    "there is no " + name + " on the server at " + address_ + "; see 'legopt status'");
}

std::string ReasonWithOwnWorkers(const ExperimentStatus& status, const nlohmann::json& reply) {
  const auto workers = reply.value("workers", nlohmann::json::array());
  const bool connected = std::any_of(workers.begin(), workers.end(),
                                     [](const nlohmann::json& worker) { return worker.value("online", false); });
  if (status.waiting_for.empty() || connected || status.hold != ExperimentHold::kNone || !StoreError(reply).empty()) {
    return status.waiting_for;
  }
  return "the workers load the dataset";
}

ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, WatchView& view,
                                 const WatchOptions& options) {
  StoreOutageMonitor trouble;
  WatchedExperiment watched(experiment_id, server.address());
  StallTimeout deadline(options.give_up);
  ServerPatience patience(std::min(options.patience, options.give_up.value_or(options.patience)),
                          options.has_answered ? std::optional(Now()) : std::nullopt);
  for (int interval_ms = kFirstInterval_ms;; interval_ms = std::min(interval_ms * 2, kInterval_ms)) {
    if (Interrupted()) trouble.ThrowIfAny();
    if (Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
    if (options.tick) options.tick();
    nlohmann::json reply;
    try {
      reply = server.Status(experiment_id);
    } catch (const ClientError& error) {
      if (error.code() == ExitCode::kInterrupted) trouble.ThrowIfAny();
      if (error.code() != ExitCode::kUnreachable) throw;
      patience.Silent(Now(), error, view);
      continue;
    }
    patience.Answered(Now(), view);
    ExperimentStatus status = watched.Find(reply);
    if (options.own_workers) status.waiting_for = ReasonWithOwnWorkers(status, reply);
    trouble.Look(reply, &view);
    view.Show(status);
    if (status.over()) return status;
    deadline.Look(Now(), status);
    ::poll(nullptr, 0, interval_ms);
  }
}

ExperimentStatus WatchOnTerminal(ServerConnection& server, std::int64_t experiment_id, const WatchOptions& options) {
  ProgressPrinter printer;
  const ExperimentStatus status = WatchExperiment(server, experiment_id, printer, options);
  printer.Break();
  std::fprintf(stderr, "%s\n", RenderSummary(status).c_str());
  return status;
}

ExitCode OutcomeOf(const ExperimentStatus& status) {
  if (status.dead > 0 || status.failed > 0) return ExitCode::kJobsFailed;
  return status.state == ExperimentState::kCancelled ? ExitCode::kInterrupted : ExitCode::kOk;
}

std::string FailureHint(const ExperimentStatus& status, const std::string& source_flags) {
  if (status.dead == 0 && status.failed == 0) return {};
  std::string text;
  if (status.dead > 0) text += std::to_string(status.dead) + " jobs died";
  if (status.failed > 0) text += (text.empty() ? "" : ", ") + std::to_string(status.failed) + " could not run";
  return text + "; see 'legopt list " + std::to_string(status.id) + " --state " +
         (status.dead > 0 ? "dead" : "failed") + source_flags + "'";
}

}  // namespace legopt::client
