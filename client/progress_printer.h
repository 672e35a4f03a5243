#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "client/experiment_status.h"
#include "client/progress.h"

namespace legopt::client {

/// Shows progress on standard error: one line that renews itself on a terminal, otherwise a plain line at the start,
/// whenever a tenth of the jobs more has finished, at least every `kQuietPeriod` while something changes, and at the
/// end.
class ProgressPrinter {
 public:
  ProgressPrinter();
  /// Leaves the terminal on a fresh line.
  ~ProgressPrinter();
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  /// `note` stands behind the progress, e.g. why nothing moves; a plain line repeats it every kQuietPeriod.
  void Show(const ExperimentStatus& status, const std::string& note = {});

  /// Ends the renewed line, so that something else may be printed. The next Show starts another one.
  void Break();

  /// Since the printer was made.
  Seconds elapsed() const;

 private:
  static constexpr Seconds kQuietPeriod{10};
  bool DueAsLine(const ExperimentStatus& status, const std::string& note) const;

  bool terminal_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point start_;
  PaceMeter meter_;
  std::optional<ExperimentStatus> last_;
  std::string last_note_;
  Seconds last_time_{0};
};

}  // namespace legopt::client
