#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

using Seconds = std::chrono::duration<double>;

/// Receives events while an experiment is watched.
class WatchView {
 public:
  virtual ~WatchView() = default;
  /// Shows the current status; called a few times per second.
  virtual void Show(const ExperimentStatus& status) = 0;
  /// The server has not answered for `silence`; calls are repeated for up to `patience`. Called once per silence.
  virtual void ServerSilent(Seconds silence, Seconds patience) = 0;
  virtual void ServerBack() = 0;
  /// Called before other output is printed.
  virtual void Break() {}
};

/// Computes the rate of finished jobs from a series of observations (time, finished jobs). The rate is that of the
/// recent past, so that it follows changes of the pool and of the problems' difficulty:
///
///     rate = (finished_now - finished_then) / (now - then)
///
/// where `then` is the latest observation at least `window` old, or the first one. The rate decays while no jobs
/// finish. Jobs that finished before the first observation (a resumed experiment) are not counted, nor is the time
/// before the first job runs or while the experiment stalls.
class PaceMeter {
 public:
  explicit PaceMeter(Seconds window = Seconds(30)) : window_(window) {}

  /// Returns jobs per second; nullopt before there is enough data. `now` is any monotonic time.
  std::optional<double> Observe(Seconds now, const ExperimentStatus& status);

 private:
  struct Observation {
    Seconds time;
    std::int64_t finished;
  };
  Seconds window_;
  std::deque<Observation> observations_;
  bool working_ = false;  // a job has been running
};

/// Returns why an experiment stalls, after a delay, because every experiment waits briefly between jobs.
class StallNotice {
 public:
  explicit StallNotice(Seconds patience = Seconds(1)) : patience_(patience) {}

  /// Returns the current reason, or an empty string. `now` is any monotonic time.
  std::string Observe(Seconds now, const ExperimentStatus& status);

 private:
  Seconds patience_;
  std::optional<Seconds> since_;
};

/// Returns e.g. "0:07", "3:12", "1:02:03"; rounded to the nearest second.
std::string FormatDuration(Seconds duration);

/// Returns the elapsed time: "0:07" since submission; "0:07 of work" if the experiment was idle for a large part of
/// that time (paused, no workers, no server).
std::string FormatElapsed(const ExperimentStatus& status);

/// Returns a line of at most `width` columns for a terminal, without a line end:
///
///     [==========>         ] 52/80  38 solved  12.3 jobs/s  0:04  ETA 0:02
///     [==========>         ] 52/80  38 solved  0:04  no worker is connected
///
/// Dead and failed jobs are shown if there are any, and so are the solved windows of running jobs ("windows 3/40,
/// 7/61"). `note`, the reason for a stall, replaces rate and ETA; the part after its first ';' is dropped if there is
/// no space. Other parts that do not fit are dropped in this order: the elapsed time, the rate, the windows, the bar.
std::string RenderProgressBar(const ExperimentStatus& status, std::optional<double> jobs_per_s, const std::string& note,
                              int width);

/// Returns the same information as a plain line for a log file.
std::string RenderProgressLine(const ExperimentStatus& status, std::optional<double> jobs_per_s,
                               const std::string& note);

/// Returns the final line: "80 of 80 jobs in 7.0 s: 78 solved, 1 not solved, 1 dead", from submission to end; if it was
/// idle for a large part of that time: "80 of 80 jobs in 20:13:05 (9.0 s of work): ...".
std::string RenderSummary(const ExperimentStatus& status);

/// Shows progress on standard error: on a terminal a line that is updated in place; otherwise a plain line at the
/// start, after every tenth of the jobs, when a stall begins or ends, at least every `kQuietPeriod` while there are
/// changes (`kWaitingPeriod` during a stall), and at the end.
class ProgressPrinter final : public WatchView {
 public:
  ProgressPrinter();
  /// Leaves the terminal's cursor on a new line.
  ~ProgressPrinter() override;
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void Show(const ExperimentStatus& status) override;
  void ServerSilent(Seconds silence, Seconds patience) override;
  void ServerBack() override;
  /// Ends the line that is updated in place, so that other output can follow. The next Show starts a new one.
  void Break() override;

 private:
  static constexpr Seconds kQuietPeriod{10};
  static constexpr Seconds kWaitingPeriod{60};
  bool DueAsLine(const ExperimentStatus& status, const std::string& note) const;
  Seconds elapsed() const;

  bool terminal_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point start_;
  PaceMeter meter_;
  StallNotice stall_notice_;
  std::optional<ExperimentStatus> last_;
  std::string last_note_;
  Seconds last_time_{0};
};

/// Progress events as JSON, one object per line, for programs. Every object has
///
///     "event": "progress", "silent" (the server does not answer), "back" (it answers again) or "end" (the last line),
///     "at_us": microseconds since 1970 by this machine's clock, "experiment": its id
///
/// A "progress" event also has "name", "state" ("active", "done", "cancelled"), "hold" ("none", "paused"),
/// "hold_reason", "waiting_for" (why it stalls; empty while it progresses), the numbers of jobs "total", "queued",
/// "leased", "done", "failed", "dead", "cancelled", "solved", the times "elapsed_s", "worked_s" (or null) and "eta_s"
/// (or null), the "share" of busy slots, and "running": {"job", "task", "worker", "done", "total"} of jobs with
/// reported progress. A "silent" event has "silent_s". An "end" event has "exit_code", "reason" (empty if the
/// experiment is over), and all members of the last "progress" event, if any.
///
/// A "progress" event is written at the start and at the end, when a value other than a time has changed, at most once
/// per `interval`, and every ten intervals without changes.
class WatchJson final : public WatchView {
 public:
  using Clock = std::function<Seconds()>;                 ///< monotonic
  using WallClock = std::function<std::int64_t()>;        ///< microseconds since 1970
  using Write = std::function<void(const std::string&)>;  ///< takes one line without its end

  WatchJson(std::int64_t experiment_id, Seconds interval, Clock clock, WallClock wall_clock, Write write);

  void Show(const ExperimentStatus& status) override;
  void ServerSilent(Seconds silence, Seconds patience) override;
  void ServerBack() override;
  void End(ExitCode exit_code, const std::string& reason);

 private:
  bool Due(const ExperimentStatus& status) const;
  nlohmann::ordered_json Event(const char* name) const;

  std::int64_t experiment_id_;
  Seconds interval_;
  Clock clock_;
  WallClock wall_clock_;
  Write write_;
  std::optional<ExperimentStatus> latest_, written_;
  Seconds written_at_{0};
};

/// Progress of a generation on standard error: a line that is updated in place on a terminal, otherwise a plain line at
/// the start of every stage, every ten seconds, and at its end. Thread rule: one thread.
class GenerationProgress {
 public:
  GenerationProgress();
  ~GenerationProgress();
  GenerationProgress(const GenerationProgress&) = delete;
  GenerationProgress& operator=(const GenerationProgress&) = delete;

  /// Shows e.g. "collapse 0.30 of 2.60 s, 12 s" with the estimated remaining time, if known.
  void Show(const std::string& stage, double done, double total, const std::string& unit);
  /// Ends the line that is updated in place.
  void Break();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_;
  bool line_open_ = false;
  std::string stage_;
  Clock::time_point stage_start_;
  Clock::time_point shown_;
};

}  // namespace legopt::client
