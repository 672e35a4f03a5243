#include "client/report/generation_progress.h"

#include <unistd.h>

#include <iomanip>
#include <iostream>

#include "client/report/progress.h"
#include "legopt/types/classic_stream.h"

namespace legopt::client {

GenerationProgress::GenerationProgress() : terminal_(isatty(STDERR_FILENO) != 0) {}

GenerationProgress::~GenerationProgress() { Break(); }

void GenerationProgress::Break() {
  if (line_open_) std::cerr << std::endl;
  line_open_ = false;
}

void GenerationProgress::Show(const std::string& stage, double done, double total, const std::string& unit) {
  const Clock::time_point now = Clock::now();
  const bool fresh = stage != stage_;
  if (fresh) {
    Break();
    stage_ = stage;
    stage_start_ = now;
  }
  constexpr auto kTerminalPeriod = std::chrono::milliseconds(200);
  constexpr auto kQuietPeriod = std::chrono::seconds(10);
  const bool last = done >= total;
  const Clock::duration period = terminal_ ? Clock::duration(kTerminalPeriod) : Clock::duration(kQuietPeriod);
  if (!fresh && !last && now - shown_ < period) return;
  shown_ = now;
  ClassicOutput line;
  line << stage << " " << std::setprecision(4) << done << " of " << total << " " << unit;
  const Seconds elapsed = now - stage_start_;
  line << ", " << FormatDuration(elapsed);
  if (done > 0 && !last) line << ", about " << FormatDuration(elapsed * (total - done) / done) << " left";
  if (terminal_) {
    std::cerr << "\r\033[K" << line.str() << std::flush;
    line_open_ = true;
  } else {
    std::cerr << line.str() << std::endl;
  }
}

}  // namespace legopt::client
