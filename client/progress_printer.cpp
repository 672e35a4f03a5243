#include "client/progress_printer.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace legopt::client {
namespace {

int TerminalWidth() {
  constexpr int kDefaultWidth = 80;
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kDefaultWidth;
  return size.ws_col;
}

}  // namespace

ProgressPrinter::ProgressPrinter()
    : terminal_(::isatty(STDERR_FILENO) == 1), start_(std::chrono::steady_clock::now()) {}

ProgressPrinter::~ProgressPrinter() { Break(); }

Seconds ProgressPrinter::elapsed() const { return std::chrono::steady_clock::now() - start_; }

void ProgressPrinter::Break() {
  if (line_open_) std::fputs("\n", stderr);
  line_open_ = false;
}

bool ProgressPrinter::DueAsLine(const ExperimentStatus& status, const std::string& note) const {
  constexpr std::int64_t kParts = 10;
  if (!last_ || (status.over() && !last_->over())) return true;
  if (note != last_note_) return true;
  if (status == *last_ && note.empty()) return false;
  const auto part = [&](const ExperimentStatus& s) { return s.total > 0 ? s.finished() * kParts / s.total : 0; };
  return part(status) > part(*last_) || elapsed() - last_time_ >= kQuietPeriod;
}

void ProgressPrinter::Show(const ExperimentStatus& status, const std::string& note) {
  const Pace pace = meter_.Observe(elapsed(), status);
  if (terminal_) {
    // One column less than the terminal has: a full line would wrap on some.
    const int width = TerminalWidth() - 1;
    const std::string end = (note.empty() ? "" : "  " + note).substr(0, static_cast<std::size_t>(std::max(width, 0)));
    const std::string bar = RenderProgressBar(status, pace, width - static_cast<int>(end.size()));
    std::fprintf(stderr, "\r\033[K%s%s", bar.c_str(), end.c_str());
    std::fflush(stderr);
    line_open_ = true;
    return;
  }
  if (!DueAsLine(status, note)) return;
  std::fprintf(stderr, "%s%s%s\n", RenderProgressLine(status, pace).c_str(), note.empty() ? "" : "  ", note.c_str());
  last_ = status;
  last_note_ = note;
  last_time_ = elapsed();
}

}  // namespace legopt::client
