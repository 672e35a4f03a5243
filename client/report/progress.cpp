#include "client/report/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "app/printable.h"
#include "app/program_main.h"
#include "client/report/escaped_text.h"
#include "legopt/input/json.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr int kMinBarWidth = 10;
constexpr int kMaxBarWidth = 40;
constexpr Seconds kMinEvidence{0.2};  // shorter intervals give no reliable rate

std::string FormatRate(double jobs_per_s) {
  constexpr double kSecondsPerMinute = 60;
  if (jobs_per_s >= 100) return FormatFixed(jobs_per_s, 0) + " jobs/s";
  if (jobs_per_s >= 1) return FormatFixed(jobs_per_s, 1) + " jobs/s";
  return FormatFixed(jobs_per_s * kSecondsPerMinute, 1) + " jobs/min";
}

// Mentions the rule if it is not the default.
std::string Solved(const ExperimentStatus& status) {
  const std::string rule = status.rule == Rule::kSolid ? "" : " (" + std::string(ToString(status.rule)) + " rule)";
  return std::to_string(status.solved) + " solved" + rule;
}

std::string Counts(const ExperimentStatus& status) {
  std::string text = std::to_string(status.finished()) + "/" + std::to_string(status.total);
  text += "  " + Solved(status);
  if (status.taken_over > 0) text += "  " + std::to_string(status.taken_over) + " reused";
  if (status.dead > 0) text += "  " + std::to_string(status.dead) + " dead";
  if (status.failed > 0) text += "  " + std::to_string(status.failed) + " cannot run";
  if (status.cancelled > 0) text += "  " + std::to_string(status.cancelled) + " cancelled";
  return text;
}

// Returns "windows 3/40, 7/61": the progress of running jobs that are solved by windows. Other jobs are too short to be
// shown.
std::string Windows(const ExperimentStatus& status) {
  constexpr int kMaxShown = 4;
  std::string text;
  int jobs = 0;
  for (const RunningJob& job : status.running) {
    if (!DescriptionOf(job.task).windowed || ++jobs > kMaxShown) continue;
    text += (jobs == 1 ? "windows " : ", ") + std::to_string(job.done) + "/" + std::to_string(job.total);
  }
  if (jobs > kMaxShown) text += ", +" + std::to_string(jobs - kMaxShown);
  return text;
}

std::string Estimate(const ExperimentStatus& status) {
  if (status.finished() >= status.total) return {};
  return "ETA " + (status.eta_s ? FormatDuration(Seconds(*status.eta_s)) : std::string("-"));
}

// Returns whether the experiment was idle for a large part of its time.
bool HadLongBreaks(const ExperimentStatus& status) {
  constexpr double kUsualShare = 0.8, kUsual_s = 5;
  return status.worked_s && *status.worked_s < kUsualShare * status.elapsed_s - kUsual_s;
}

std::string WithTenths(Seconds duration) {
  constexpr Seconds kMinute{60};
  if (duration >= kMinute) return FormatDuration(duration);
  return FormatFixed(duration.count(), 1) + " s";
}

std::string Bar(std::int64_t finished, std::int64_t total, int width) {
  const double share = total > 0 ? static_cast<double>(finished) / static_cast<double>(total) : 1.0;
  // Rounded down: only a complete experiment shows a full bar.
  const int filled = std::clamp(static_cast<int>(std::floor(share * width)), 0, width);
  std::string bar(static_cast<std::size_t>(filled), '=');
  if (filled < width) bar += '>';
  bar.resize(static_cast<std::size_t>(width), ' ');
  return "[" + bar + "]";
}

std::string Join(const std::vector<std::string>& parts) {
  std::string text;
  for (const auto& part : parts) {
    if (!part.empty()) text += (text.empty() ? "" : "  ") + part;
  }
  return text;
}

}  // namespace

std::optional<double> PaceMeter::Observe(Seconds now, const ExperimentStatus& status) {
  const std::int64_t finished = status.finished();
  if (!status.waiting_for.empty()) {
    working_ = false;
    observations_ = {{now, finished}};
    return std::nullopt;
  }
  const bool progress = !observations_.empty() && finished > observations_.front().finished;
  if (!working_ && !progress) observations_.clear();
  working_ = working_ || progress || status.leased > 0;
  observations_.push_back({now, finished});
  while (observations_.size() > 2 && now - observations_[1].time >= window_) observations_.pop_front();
  const Observation& then = observations_.front();
  const Seconds stretch = now - then.time;
  if (stretch < kMinEvidence || finished <= then.finished) return std::nullopt;
  return static_cast<double>(finished - then.finished) / stretch.count();
}

std::string StallNotice::Observe(Seconds now, const ExperimentStatus& status) {
  if (status.over() || status.waiting_for.empty()) {
    since_.reset();
    return {};
  }
  if (!since_) since_ = now;
  return now - *since_ >= patience_ ? status.waiting_for : std::string();
}

std::string FormatDuration(Seconds duration) {
  constexpr long long kMinute = 60, kHour = 3600;
  constexpr double kLongest_s = 3.6e9;
  const long long seconds = std::llround(std::clamp(duration.count(), 0.0, kLongest_s));
  char text[48];
  if (seconds >= kHour) {
    std::snprintf(text, sizeof(text), "%lld:%02lld:%02lld", seconds / kHour, seconds % kHour / kMinute,
                  seconds % kMinute);
  } else {
    std::snprintf(text, sizeof(text), "%lld:%02lld", seconds / kMinute, seconds % kMinute);
  }
  return text;
}

std::string FormatElapsed(const ExperimentStatus& status) {
  if (HadLongBreaks(status)) return FormatDuration(Seconds(*status.worked_s)) + " of work";
  return FormatDuration(Seconds(status.elapsed_s));
}

std::string RenderProgressBar(const ExperimentStatus& status, std::optional<double> jobs_per_s, const std::string& note,
                              int width) {
  const auto limit = static_cast<std::size_t>(std::max(width, 0));
  const std::string counts = Counts(status);
  const std::string elapsed = FormatElapsed(status);
  const std::string windows = Windows(status);
  const std::string short_note = note.substr(0, note.find(';'));
  const std::string rate = jobs_per_s && note.empty() ? FormatRate(*jobs_per_s) : "";
  const std::string end = note.empty() ? Estimate(status) : short_note;
  // Ordered from complete to minimal; the first one that fits is used.
  std::vector<std::string> variants = {Join({counts, windows, rate, elapsed, end}), Join({counts, windows, rate, end}),
                                       Join({counts, windows, end}), Join({counts, end})};
  if (!note.empty()) variants.insert(variants.begin(), Join({counts, windows, elapsed, note}));
  constexpr std::size_t kBrackets = 3;  // "[", "]" and the following space
  for (const auto& text : variants) {
    if (text.size() + kBrackets + kMinBarWidth > limit) continue;
    const int bar = std::min<int>(kMaxBarWidth, static_cast<int>(limit - text.size() - kBrackets));
    return Bar(status.finished(), status.total, bar) + " " + text;
  }
  for (const auto& text : {variants.back(), counts}) {
    if (text.size() <= limit || !note.empty()) return text.substr(0, limit);
  }
  return counts.substr(0, limit);
}

std::string RenderProgressLine(const ExperimentStatus& status, std::optional<double> jobs_per_s,
                               const std::string& note) {
  const std::string rate = jobs_per_s && note.empty() ? FormatRate(*jobs_per_s) : "";
  return Join({"experiment " + std::to_string(status.id) + ":", Counts(status), Windows(status), rate,
               FormatElapsed(status), note.empty() ? Estimate(status) : note});
}

std::string RenderSummary(const ExperimentStatus& status) {
  std::string text = std::to_string(status.finished()) + " of " + std::to_string(status.total) + " jobs in " +
                     WithTenths(Seconds(status.elapsed_s));
  if (HadLongBreaks(status)) text += " (" + WithTenths(Seconds(*status.worked_s)) + " of work)";
  text += ": " + Solved(status) + ", " + std::to_string(status.done - status.solved) + " not solved";
  if (status.taken_over > 0) text += ", " + std::to_string(status.taken_over) + " reused from other experiments";
  if (status.dead > 0) text += ", " + std::to_string(status.dead) + " dead";
  if (status.failed > 0) text += ", " + std::to_string(status.failed) + " could not run";
  if (status.cancelled > 0) text += ", " + std::to_string(status.cancelled) + " cancelled";
  return text;
}

namespace {

int TerminalWidth() {
  constexpr int kDefaultWidth = 80;
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kDefaultWidth;
  return size.ws_col;
}

// Ends a long command if the reader of its progress has closed the pipe ('2>&1 | head').
void RequireReaderOfErrors() {
  if (std::ferror(stderr) != 0) app::RequireReader(STDERR_FILENO);
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
    RequireReaderOfErrors();
    return;
  }
  if (!DueAsLine(status, note)) return;
  std::fprintf(stderr, "%s\n", RenderProgressLine(status, rate, note).c_str());
  RequireReaderOfErrors();
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

namespace {

using Json = nlohmann::ordered_json;

Json OrNull(const std::optional<double>& number) { return number ? Json(*number) : Json(); }

void AddProgress(const ExperimentStatus& status, Json* line) {
  Json running = Json::array();
  for (const RunningJob& job : status.running) {
    running.push_back({{"job", job.job},
                       {"task", ToString(job.task)},
                       {"worker", job.worker},
                       {"done", job.done},
                       {"total", job.total}});
  }
  line->update(Json{{"name", status.name},
                    {"state", ToString(status.state)},
                    {"hold", ToString(status.hold)},
                    {"hold_reason", status.hold_reason},
                    {"waiting_for", status.waiting_for},
                    {"total", status.total},
                    {"queued", status.queued},
                    {"leased", status.leased},
                    {"done", status.done},
                    {"failed", status.failed},
                    {"dead", status.dead},
                    {"cancelled", status.cancelled},
                    {"solved", status.solved},
                    {"rule", ToString(status.rule)},
                    {"taken_over", status.taken_over},
                    {"elapsed_s", status.elapsed_s},
                    {"worked_s", OrNull(status.worked_s)},
                    {"eta_s", OrNull(status.eta_s)},
                    {"share", status.share},
                    {"running", std::move(running)}});
}

}  // namespace

WatchJson::WatchJson(std::int64_t experiment_id, Seconds interval, Clock clock, WallClock wall_clock, Write write)
    : experiment_id_(experiment_id),
      interval_(interval),
      clock_(std::move(clock)),
      wall_clock_(std::move(wall_clock)),
      write_(std::move(write)) {}

Json WatchJson::Event(const char* name) const {
  return {{"event", name}, {"at_us", wall_clock_()}, {"experiment", experiment_id_}};
}

bool WatchJson::Due(const ExperimentStatus& status) const {
  constexpr int kIntervalsUnchanged = 10;
  if (!written_ || status.over()) return true;
  const Seconds since = clock_() - written_at_;
  return since >= (SameProgress(status, *written_) ? kIntervalsUnchanged * interval_ : interval_);
}

void WatchJson::Show(const ExperimentStatus& status) {
  latest_ = status;
  if (!Due(status)) return;
  Json line = Event("progress");
  AddProgress(status, &line);
  write_(JsonText(line, -1));
  written_ = status;
  written_at_ = clock_();
}

void WatchJson::ServerSilent(Seconds silence, Seconds /*patience*/) {
  Json line = Event("silent");
  line["silent_s"] = silence.count();
  write_(JsonText(line, -1));
}

void WatchJson::ServerBack() { write_(Dump(Event("back"))); }

void WatchJson::End(ExitCode exit_code, const std::string& reason) {
  Json line = Event("end");
  line["exit_code"] = static_cast<int>(exit_code);
  line["reason"] = reason;
  if (latest_) AddProgress(*latest_, &line);
  write_(JsonText(line, -1));
}

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
  RequireReaderOfErrors();
}

}  // namespace legopt::client
