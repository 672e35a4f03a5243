#pragma once

#include <chrono>
#include <string>

namespace legopt::client {

/// Progress of a generation on standard error: a line that renews itself on a terminal, otherwise a plain line at the
/// beginning of every stage, every ten seconds, and at its end. One thread.
class GenerationProgress {
 public:
  GenerationProgress();
  ~GenerationProgress();
  GenerationProgress(const GenerationProgress&) = delete;
  GenerationProgress& operator=(const GenerationProgress&) = delete;

  /// "collapse 0.30 of 2.60 s, 12 s" with the time that is left when it can be estimated.
  void Show(const std::string& stage, double done, double total, const std::string& unit);
  /// Ends the renewed line.
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
