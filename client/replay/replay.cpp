#include "client/replay/replay.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/isolated_call.h"
#include "legopt/input/json.h"
#include "legopt/planning/internal/trace.h"
#include "legopt/types/number_text.h"
#include "legopt/types/read_guard.h"

namespace legopt::client {
namespace {

std::string TextOf(std::int64_t value) { return std::to_string(value); }
std::string TextOf(SolveStatus value) { return std::string(ToString(value)); }
std::string TextOf(Verdict value) { return std::string(ToString(value)); }
std::string TextOf(double value) { return FormatGeneral(value, 17); }

// Collects differences as sentences.
class Differences {
 public:
  explicit Differences(std::vector<std::string>* texts) : texts_(texts) {}

  template <class Value>
  bool Add(const char* name, Value stored, Value now) {
    if (stored == now) return false;
    texts_->push_back(std::string(name) + ": " + TextOf(stored) + " stored, " + TextOf(now) + " now");
    return true;
  }
  // Compares a count that older servers did not store.
  bool Add(const char* name, const std::optional<std::int64_t>& stored, std::int64_t now) {
    return stored && Add(name, *stored, now);
  }
  // Values that are not finite are stored as NULL.
  bool Add(const char* name, const std::optional<double>& stored, double now) {
    if (stored && std::isfinite(now)) return Add(name, *stored, now);
    if (stored.has_value() == std::isfinite(now)) return false;
    texts_->push_back(std::string(name) + ": " + (stored ? TextOf(*stored) : "none") + " stored, " +
                      (std::isfinite(now) ? TextOf(now) : "none") + " now");
    return true;
  }

 private:
  std::vector<std::string>* texts_;
};

bool SameBits(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

void CompareWaypoints(const std::vector<Eigen::VectorXd>& stored, const std::vector<Eigen::VectorXd>& now,
                      std::vector<std::string>* differences) {
  if (stored.size() != now.size()) {
    differences->push_back("waypoints: " + std::to_string(stored.size()) + " stored, " + std::to_string(now.size()) +
                           " now");
    return;
  }
  std::size_t first = stored.size(), unequal = 0;
  for (std::size_t i = stored.size(); i-- > 0;) {
    if (SameBits(stored[i], now[i])) continue;
    first = i;
    ++unequal;
  }
  if (unequal == 0) return;
  differences->push_back("waypoints: " + std::to_string(unequal) + " of " + std::to_string(stored.size()) +
                         " have other bits, first " + std::to_string(first));
}

// Before schema version 11, a motion with an unsolved window was stored with the verdict for a wrong number of
// waypoints.
bool IsUnsolvedAsBefore(Verdict stored, Verdict now) {
  return stored == Verdict::kWrongWaypointCount && now == Verdict::kWindowUnsolved;
}

std::string Place(const IterationRecord& step) {
  return "window " + std::to_string(step.window) + ", restart " + std::to_string(step.restart) + ", start " +
         std::to_string(step.start) + ", step " + std::to_string(step.step);
}

// Returns all fields that a replay must reproduce: all except the time.
nlohmann::ordered_json RepeatedPart(const IterationRecord& step) {
  return {{"step", step.step},          {"window", step.window},           {"restart", step.restart},
          {"start", step.start},        {"penalty", step.penalty},         {"trust_box", step.trust_box},
          {"accepted", step.accepted},  {"evaluations", step.evaluations}, {"cost", step.cost},
          {"violation", step.violation}};
}

nlohmann::ordered_json JsonOf(const Replay& replay) {
  return {
      {"outcome", EnumNumber(replay.outcome)}, {"differences", replay.differences}, {"divergence", replay.divergence}};
}

Replay FromJson(const std::string& text, std::int64_t job_id) {
  const auto json = ParseJson(text, "answer of the replay");
  return {job_id, Reproduction{json.at("outcome").get<std::uint8_t>()},
          json.at("differences").get<std::vector<std::string>>(), json.at("divergence").get<std::string>()};
}

// Solves in a separate process; a crash is an outcome.
Replay ReplayOne(JobRunner& runner, const StoredJob& stored) {
  constexpr double kLimits = 10.0;
  constexpr ReadLimits kUnlimited{.cpu_s = 30 * 86'400, .wall_s = 30 * 86'400, .memory_bytes = 0};
  const auto solve = [&]() -> std::string {
    Job job = stored.job;
    job.wall_limit_s *= kLimits;
    return Dump(JsonOf(CompareResults(stored, runner.Run(job))));
  };
  try {
    return FromJson(CallIsolated(solve, kUnlimited), stored.job_id);
  } catch (const GuardedReadError& error) {
    return {stored.job_id, Reproduction::kDiffers, {"its process gave no result: " + std::string(error.what())}, ""};
  }
}

}  // namespace

Replay CompareResults(const StoredJob& stored, const JobResult& now) {
  Replay replay{stored.job_id, Reproduction::kBitIdentical, {}, {}};
  Differences differences(&replay.differences);
  bool other = differences.Add("solver status", stored.status, now.solve.status);
  if (!IsUnsolvedAsBefore(stored.literal, now.evaluation.literal)) {
    other = differences.Add("literal verdict", stored.literal, now.evaluation.literal) || other;
    other = differences.Add("strict verdict", stored.strict, now.evaluation.strict) || other;
    if (stored.solid) other = differences.Add("solid verdict", *stored.solid, now.evaluation.solid) || other;
    if (stored.physical) {
      other = differences.Add("physical verdict", *stored.physical, now.evaluation.physical) || other;
    }
  }
  differences.Add("iterations", stored.iterations, static_cast<std::int64_t>(now.solve.iterations));
  differences.Add("restarts", stored.restarts, static_cast<std::int64_t>(now.solve.restarts));
  differences.Add("starts", stored.starts, now.solve.starts);
  differences.Add("term evaluations", stored.term_evaluations, now.solve.term_evaluations);
  differences.Add("collision queries", stored.collision_queries, now.solve.collision_queries);
  differences.Add("work", stored.work_ns, now.solve.work_ns);
  if (stored.margin_relaxed) differences.Add("relaxed margin", *stored.margin_relaxed, now.solve.margin_relaxed);
  differences.Add("solver's cost", stored.solver_cost, now.solve.cost);
  differences.Add("solver's violation", stored.solver_violation, now.solve.max_violation);
  differences.Add("cost", stored.cost, now.evaluation.cost);
  CompareWaypoints(stored.waypoints, now.solve.waypoints, &replay.differences);
  if (!stored.unsolved.empty() && now.solve.unsolved) {
    CompareWaypoints(stored.unsolved, now.solve.unsolved->waypoints, &replay.differences);
  }
  replay.divergence = FirstDivergence(stored.trace, now.solve.history);
  if (other) {
    replay.outcome = Reproduction::kDiffers;
  } else if (!replay.differences.empty() || !replay.divergence.empty()) {
    replay.outcome = Reproduction::kSameStatus;
  }
  return replay;
}

std::string FirstDivergence(std::span<const IterationRecord> stored, std::span<const IterationRecord> now) {
  if (stored.empty()) return {};
  const std::vector<IterationRecord> kept = CondenseTrace(now);
  for (std::size_t i = 0; i < std::min(stored.size(), kept.size()); ++i) {
    const nlohmann::ordered_json then = RepeatedPart(stored[i]), again = RepeatedPart(kept[i]);
    if (then != again) return "at " + Place(stored[i]) + ": " + Dump(then) + " stored, " + Dump(again) + " now";
  }
  if (kept.size() < stored.size()) return "at " + Place(stored[kept.size()]) + ", where it ends now";
  return kept.size() > stored.size() ? "behind the end of the stored one" : "";
}

std::vector<Replay> ReplayJobs(JobRunner& runner, std::span<const StoredJob> jobs, int parallel,
                               const std::function<void(const Replay&)>& done) {
  std::vector<Replay> replays(jobs.size());
  std::atomic<std::size_t> next = 0;
  std::mutex telling;
  const auto work = [&] {
    for (std::size_t i = next++; i < jobs.size(); i = next++) {
      replays[i] = ReplayOne(runner, jobs[i]);
      const std::lock_guard lock(telling);
      done(replays[i]);
    }
  };
  std::vector<std::jthread> threads;
  for (int i = 1; i < parallel; ++i) threads.emplace_back(work);
  work();
  threads.clear();
  return replays;
}

}  // namespace legopt::client
