#include "client/report/progress_printer.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>

#include "app/printable.h"
#include "legopt/types/number_text.h"

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
  const Seconds since = elapsed() - last_time_;
  if (!note.empty()) return since >= kWaitingPeriod;
  if (SameProgress(status, *last_)) return false;
  const auto part = [&](const ExperimentStatus& s) { return s.total > 0 ? s.finished() * kParts / s.total : 0; };
  return part(status) > part(*last_) || since >= kQuietPeriod;
}

void ProgressPrinter::Show(const ExperimentStatus& status) {
  const std::optional<double> rate = meter_.Observe(elapsed(), status);
  const std::string note = app::Printable(stall_notice_.Observe(elapsed(), status));
  if (terminal_) {
    // One column less than the terminal's width: some terminals wrap full lines.
    std::fprintf(stderr, "\r\033[K%s", RenderProgressBar(status, rate, note, TerminalWidth() - 1).c_str());
    std::fflush(stderr);
    line_open_ = true;
    return;
  }
  if (!DueAsLine(status, note)) return;
  std::fprintf(stderr, "%s\n", RenderProgressLine(status, rate, note).c_str());
  last_ = status;
  last_note_ = note;
  last_time_ = elapsed();
}

void ProgressPrinter::ServerSilent(Seconds silence, Seconds patience) {
  Break();
  std::fprintf(stderr, "legopt: no answer for %s s; waiting for the server to come back, for up to %s\n",
               FormatFixed(silence.count(), 0).c_str(), FormatDuration(patience).c_str());
}

void ProgressPrinter::ServerBack() {
  Break();
  std::fprintf(stderr, "legopt: the server answers again\n");
}

}  // namespace legopt::client
