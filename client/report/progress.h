#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "client/report/watch_view.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

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

}  // namespace legopt::client
