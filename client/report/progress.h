#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "client/report/watch_view.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

/// Turns a series of observations (time, finished jobs) into a rate, that of the recent past, so that it follows a pool
/// that grows, shrinks or gets to harder problems:
///
///     rate = (finished_now - finished_then) / (now - then)
///
/// with `then` the youngest observation at least `window` old, or the first one. While nothing finishes the rate decays
/// by itself. Jobs that were finished before watching began (a resumed experiment) do not count as speed, and neither
/// does the time before the first job is worked on, nor that in which the experiment stands still.
class PaceMeter {
 public:
  explicit PaceMeter(Seconds window = Seconds(30)) : window_(window) {}

  /// Jobs per second; none before there is evidence. `now` is any steady time and does not go back.
  std::optional<double> Observe(Seconds now, const ExperimentStatus& status);

 private:
  struct Observation {
    Seconds time;
    std::int64_t finished;
  };
  Seconds window_;
  std::deque<Observation> observations_;
  bool working_ = false;  // a job has been worked on
};

/// Why an experiment stands still, once it has done so for a moment: between two jobs every experiment waits.
class StandstillNote {
 public:
  explicit StandstillNote(Seconds patience = Seconds(1)) : patience_(patience) {}

  /// The reason as of now, or empty. `now` is any steady time and does not go back.
  std::string Observe(Seconds now, const ExperimentStatus& status);

 private:
  Seconds patience_;
  std::optional<Seconds> since_;
};

/// "0:07", "3:12", "1:02:03"; rounded to the nearest second.
std::string FormatDuration(Seconds duration);

/// How long the experiment has taken: "0:07" since its submission; "0:07 of work" when it was not worked on for a good
/// part of that time (paused, no workers, no server).
std::string FormatElapsed(const ExperimentStatus& status);

/// One line for a terminal of `width` columns, never longer, without a line end:
///
///     [==========>         ] 52/80  38 solved  12.3 jobs/s  0:04  ETA 0:02
///     [==========>         ] 52/80  38 solved  0:04  no worker is connected
///
/// Jobs that died or could not run are shown as soon as there are any, and so are the windows solved of the jobs
/// under way ("windows 3/40, 7/61"). `note` tells why it stands still and takes the place of rate and ETA; what follows
/// its first ';' is dropped where there is no room. What else does not fit is dropped, least important part first: the
/// elapsed time, the rate, the windows, the bar.
std::string RenderProgressBar(const ExperimentStatus& status, std::optional<double> jobs_per_s, const std::string& note,
                              int width);

/// The same facts as one plain line for a log file.
std::string RenderProgressLine(const ExperimentStatus& status, std::optional<double> jobs_per_s,
                               const std::string& note);

/// The closing line: "80 of 80 jobs in 7.0 s: 78 solved, 1 not solved, 1 dead", from submission to end; where it was
/// not worked on for a good part of it: "80 of 80 jobs in 20:13:05 (9.0 s of work): ...".
std::string RenderSummary(const ExperimentStatus& status);

}  // namespace legopt::client
