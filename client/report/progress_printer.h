#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "client/report/progress.h"
#include "client/report/watch_view.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

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

}  // namespace legopt::client
