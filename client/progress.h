#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "client/experiment_status.h"

namespace legopt::client {

using Seconds = std::chrono::duration<double>;

/// What is known about the speed of an experiment at one instant.
struct Pace {
  Seconds elapsed{0};                ///< since watching began
  std::optional<double> jobs_per_s;  ///< recent rate; none before there is evidence
  std::optional<Seconds> remaining;  ///< unfinished jobs / recent rate; none without a rate, and when it is 0
};

/// Turns a series of observations (time, finished jobs) into a pace. The rate is the one of the recent past, so that
/// the estimate follows a pool that grows, shrinks or gets to harder problems:
///
///     rate = (finished_now - finished_then) / (now - then)
///
/// with `then` the youngest observation at least `window` old, or the first one. While nothing finishes the rate decays
/// by itself. Jobs that were finished before watching began (a resumed experiment) do not count as speed, and neither
/// does the time before the first job is worked on (workers are loading the dataset).
class PaceMeter {
 public:
  explicit PaceMeter(Seconds window = Seconds(30)) : window_(window) {}

  /// `now` is any steady time and does not go back.
  Pace Observe(Seconds now, const ExperimentStatus& status);

 private:
  struct Observation {
    Seconds time;
    std::int64_t finished;
  };
  Seconds window_;
  std::deque<Observation> observations_;
  std::optional<Seconds> start_;
  bool working_ = false;  // a job has been worked on
};

/// "0:07", "3:12", "1:02:03"; rounded to the nearest second.
std::string FormatDuration(Seconds duration);

/// One line for a terminal of `width` columns, never longer, without a line end:
///
///     [==========>         ] 52/80  38 solved  12.3 jobs/s  0:04  ETA 0:02
///
/// Jobs that died or could not run are shown as soon as there are any, and so are the windows solved of the motions
/// under way ("windows 3/40, 7/61"). What does not fit is dropped, least important
/// part first: the elapsed time, the rate, the windows, the bar.
std::string RenderProgressBar(const ExperimentStatus& status, const Pace& pace, int width);

/// The same facts as one plain line for a log file.
std::string RenderProgressLine(const ExperimentStatus& status, const Pace& pace);

/// The closing line: "80 of 80 jobs in 7.0 s: 78 solved, 1 not solved, 1 dead".
std::string RenderSummary(const ExperimentStatus& status, Seconds elapsed);

}  // namespace legopt::client
