#include "client/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace legopt::client {
namespace {

constexpr int kMinBarWidth = 10;
constexpr int kMaxBarWidth = 40;
constexpr Seconds kMinEvidence{0.2};  // a shorter stretch gives no honest rate

std::string FormatRate(double jobs_per_s) {
  constexpr double kSecondsPerMinute = 60;
  char text[48];
  if (jobs_per_s >= 100) {
    std::snprintf(text, sizeof(text), "%.0f jobs/s", jobs_per_s);
  } else if (jobs_per_s >= 1) {
    std::snprintf(text, sizeof(text), "%.1f jobs/s", jobs_per_s);
  } else {
    std::snprintf(text, sizeof(text), "%.1f jobs/min", jobs_per_s * kSecondsPerMinute);
  }
  return text;
}

std::string Counts(const ExperimentStatus& status) {
  std::string text = std::to_string(status.finished()) + "/" + std::to_string(status.total);
  text += "  " + std::to_string(status.solved) + " solved";
  if (status.dead > 0) text += "  " + std::to_string(status.dead) + " dead";
  if (status.failed > 0) text += "  " + std::to_string(status.failed) + " cannot run";
  if (status.cancelled > 0) text += "  " + std::to_string(status.cancelled) + " cancelled";
  return text;
}

// "windows 3/40, 7/61": how far the motions under way are. Postures are too short to be told.
std::string Windows(const ExperimentStatus& status) {
  constexpr int kMostShown = 4;
  std::string text;
  int motions = 0;
  for (const RunningJob& job : status.running) {
    if (job.task != "motion" || ++motions > kMostShown) continue;
    text += (motions == 1 ? "windows " : ", ") + std::to_string(job.done) + "/" + std::to_string(job.total);
  }
  if (motions > kMostShown) text += ", +" + std::to_string(motions - kMostShown);
  return text;
}

std::string Estimate(const ExperimentStatus& status, const Pace& pace) {
  if (status.finished() >= status.total) return {};
  return "ETA " + (pace.remaining ? FormatDuration(*pace.remaining) : std::string("-"));
}

std::string Bar(std::int64_t finished, std::int64_t total, int width) {
  const double share = total > 0 ? static_cast<double>(finished) / static_cast<double>(total) : 1.0;
  // Floor: only a complete experiment shows a full bar.
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

Pace PaceMeter::Observe(Seconds now, const ExperimentStatus& status) {
  const std::int64_t finished = status.finished();
  if (!start_) start_ = now;
  const bool progress = !observations_.empty() && finished > observations_.front().finished;
  if (!working_ && !progress) observations_.clear();
  working_ = working_ || progress || status.leased > 0;
  observations_.push_back({now, finished});
  while (observations_.size() > 2 && now - observations_[1].time >= window_) observations_.pop_front();
  Pace pace;
  pace.elapsed = now - *start_;
  const Observation& then = observations_.front();
  const Seconds stretch = now - then.time;
  if (stretch >= kMinEvidence && finished > then.finished) {
    pace.jobs_per_s = static_cast<double>(finished - then.finished) / stretch.count();
    pace.remaining =
        Seconds(static_cast<double>(std::max<std::int64_t>(status.total - finished, 0)) / *pace.jobs_per_s);
  }
  return pace;
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

std::string RenderProgressBar(const ExperimentStatus& status, const Pace& pace, int width) {
  const auto limit = static_cast<std::size_t>(std::max(width, 0));
  const std::string counts = Counts(status);
  const std::string rate = pace.jobs_per_s ? FormatRate(*pace.jobs_per_s) : "";
  const std::string elapsed = FormatDuration(pace.elapsed);
  const std::string estimate = Estimate(status, pace);
  // From complete to bare; the first one that fits is taken.
  const std::string windows = Windows(status);
  const std::vector<std::string> variants = {Join({counts, windows, rate, elapsed, estimate}),
                                             Join({counts, windows, rate, estimate}), Join({counts, windows, estimate}),
                                             Join({counts, estimate})};
  constexpr std::size_t kBrackets = 3;  // "[", "]" and the space after
  for (const auto& text : variants) {
    if (text.size() + kBrackets + kMinBarWidth > limit) continue;
    const int bar = std::min<int>(kMaxBarWidth, static_cast<int>(limit - text.size() - kBrackets));
    return Bar(status.finished(), status.total, bar) + " " + text;
  }
  for (const auto& text : {variants.back(), counts}) {
    if (text.size() <= limit) return text;
  }
  return counts.substr(0, limit);
}

std::string RenderProgressLine(const ExperimentStatus& status, const Pace& pace) {
  return Join({"experiment " + std::to_string(status.id) + ":", Counts(status), Windows(status),
               pace.jobs_per_s ? FormatRate(*pace.jobs_per_s) : "", FormatDuration(pace.elapsed),
               Estimate(status, pace)});
}

std::string RenderSummary(const ExperimentStatus& status, Seconds elapsed) {
  constexpr Seconds kMinute{60};
  char seconds[32];
  std::snprintf(seconds, sizeof(seconds), "%.1f s", elapsed.count());
  std::string text = std::to_string(status.finished()) + " of " + std::to_string(status.total) + " jobs in " +
                     (elapsed < kMinute ? std::string(seconds) : FormatDuration(elapsed)) + ": " +
                     std::to_string(status.solved) + " solved, " + std::to_string(status.done - status.solved) +
                     " not solved";
  if (status.dead > 0) text += ", " + std::to_string(status.dead) + " dead";
  if (status.failed > 0) text += ", " + std::to_string(status.failed) + " could not run";
  if (status.cancelled > 0) text += ", " + std::to_string(status.cancelled) + " cancelled";
  return text;
}

}  // namespace legopt::client
