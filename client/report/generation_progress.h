#pragma once

#include <chrono>
#include <string>

namespace legopt::client {

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
