#include "client/watching.h"

#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "client/client_error.h"
#include "client/interrupt.h"
#include "client/progress_printer.h"

namespace legopt::client {
namespace {

// Short at first, so that a run of a second does not wait for its own progress display.
constexpr int kFirstInterval_ms = 50;
constexpr int kInterval_ms = 250;

constexpr Seconds kStandstill{3};

ExperimentStatus Find(const nlohmann::json& reply, std::int64_t experiment_id, const ServerConnection& server) {
  for (auto& status : ParseExperiments(reply)) {
    if (status.id == experiment_id) return std::move(status);
  }
  throw ClientError(ExitCode::kUsage, "there is no experiment " + std::to_string(experiment_id) + " on the server at " +
                                          server.address() + "; see 'legopt status'");
}

// Says once why nothing moves.
class StandstillWarner {
 public:
  void Look(const nlohmann::json& reply, const ExperimentStatus& status, ProgressPrinter* printer) {
    if (status.over() || status.leased > 0 || status.finished() != finished_) since_ = printer->elapsed();
    finished_ = status.finished();
    if (warned_ || printer->elapsed() - since_ < kStandstill) return;
    const std::string reason = StandstillReason(reply);
    if (reason.empty()) return;
    warned_ = true;
    printer->Break();
    std::fprintf(stderr, "legopt: warning: nothing moves: %s\n", reason.c_str());
  }

 private:
  std::int64_t finished_ = 0;
  Seconds since_{0};
  bool warned_ = false;
};

}  // namespace

void StoreTrouble::Look(const nlohmann::json& status, ProgressPrinter* printer) {
  const std::string error = StoreError(status);
  const auto now = std::chrono::steady_clock::now();
  if (error.empty() != error_.empty()) {
    since_ = now;
    if (printer != nullptr) printer->Break();
    if (error.empty()) {
      std::fprintf(stderr, "legopt: the server writes its database again\n");
    } else {
      std::fprintf(stderr,
                   "legopt: warning: the server cannot write its database: %s. Nothing is lost: it goes on as soon as "
                   "it can; free some space\n",
                   error.c_str());
    }
  }
  error_ = error;
  if (now - since_ > kPatience) ThrowIfAny();
}

void StoreTrouble::ThrowIfAny() const {
  if (error_.empty()) return;
  throw ClientError(ExitCode::kDatabaseUnusable, "the server cannot write its database: " + error_ +
                                                     ". What it acknowledged is kept; free some space and go on with "
                                                     "the same command and the same --db");
}

ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, const WatchTick& tick,
                                 int max_silent_calls) {
  ProgressPrinter printer;
  StandstillWarner warner;
  StoreTrouble trouble;
  int silent_calls = 0;
  int interval_ms = kFirstInterval_ms;
  for (;;) {
    if (Interrupted()) trouble.ThrowIfAny();
    if (Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
    if (tick) tick();
    nlohmann::json reply;
    try {
      reply = server.Status(experiment_id);
    } catch (const ClientError& error) {
      if (error.code() == ExitCode::kInterrupted) trouble.ThrowIfAny();
      if (error.code() != ExitCode::kUnreachable || ++silent_calls >= max_silent_calls) throw;
      continue;
    }
    silent_calls = 0;
    const ExperimentStatus status = Find(reply, experiment_id, server);
    trouble.Look(reply, &printer);
    printer.Show(status, trouble.note());
    // With a tick, somebody sees after the workers.
    if (!tick) warner.Look(reply, status, &printer);
    if (status.over()) {
      printer.Break();
      std::fprintf(stderr, "%s\n", RenderSummary(status, printer.elapsed()).c_str());
      return status;
    }
    ::poll(nullptr, 0, interval_ms);
    interval_ms = std::min(interval_ms * 2, kInterval_ms);
  }
}

ExitCode OutcomeOf(const ExperimentStatus& status) {
  if (status.dead > 0 || status.failed > 0) return ExitCode::kJobsFailed;
  return status.state == "cancelled" ? ExitCode::kInterrupted : ExitCode::kOk;
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
