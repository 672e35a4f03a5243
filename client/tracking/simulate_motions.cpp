// Tracks timed motions in a rigid-body simulation: simulate_motions DATASET SOLUTIONS.json [SLOWDOWN]
// Prints one tab-separated row per solution, and exits with 1 if a robot falls.
#include <cstdio>
#include <string>
#include <utility>

#include "app/folder_cache.h"
#include "client/report/motion_path.h"
#include "client/report/solution_items.h"
#include "client/tracking/tracked_motion.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

void PrintRow(const SolutionItem& item, const TrackedMotion& tracked) {
  constexpr double kMillimetres = 1e3;
  std::string row = item.solution->method + '\t' + std::to_string(item.problem->id) + '\t' +
                    std::to_string(item.problem->stances.size()) + '\t' + FormatFixed(tracked.duration_s, 3) + '\t' +
                    (tracked.falls ? "falls" : "stays up");
  for (const auto& [value, digits] :
       {std::pair(tracked.fell_at_waypoint, 2), std::pair(kMillimetres * tracked.base_error_m, 1),
        std::pair(tracked.joint_error_rad, 3), std::pair(kMillimetres * tracked.slip_m, 1),
        std::pair(tracked.saturated_share, 2), std::pair(tracked.unbalanced_share, 2)}) {
    row += '\t' + FormatFixed(value, digits);
  }
  std::puts(row.c_str());
  std::fflush(stdout);
}

int Simulate(const std::string& folder, const std::string& path, double slowdown) {
  const auto dataset = Dataset::Load(folder, GuardedReader());
  const SolutionFile file = ReadSolutions(path);
  std::puts(
      "method\tproblem\tstances\tduration_s\toutcome\tfell_at_waypoint\tbase_error_mm\tjoint_error_rad\tslip_mm\t"
      "saturated_share\tunbalanced_share");
  bool falls = false;
  MotionTimer timer(*dataset);
  for (const SolutionItem& item : SolutionItems(file, *dataset)) {
    const MotionPath motion =
        ReadMotionPath(file.task, *item.problem, *item.solution, dataset->robot().configuration_size());
    std::string fault = motion.fault;
    MotionTiming timing;
    if (fault.empty()) timing = timer.Compute(motion.stances, motion.path.times, motion.path.points);
    if (fault.empty() && timing.times_s.empty()) fault = "cannot be executed: " + timing.blocked_by;
    if (!fault.empty()) {
      std::puts((item.solution->method + '\t' + std::to_string(item.problem->id) + '\t' +
                 std::to_string(item.problem->stances.size()) + "\t\t" + fault + "\t\t\t\t\t\t")
                    .c_str());
      continue;
    }
    TimedMotion timed(*dataset, timing, motion.stances, motion.path.times, motion.path.points);
    const TrackedMotion tracked = Track(*dataset, &timed, {.slowdown = slowdown});
    PrintRow(item, tracked);
    falls = falls || tracked.falls;
  }
  return falls ? 1 : 0;
}

}  // namespace
}  // namespace legopt::client

int main(int argc, char** argv) {
  constexpr int kUsage = 2;
  const std::optional<double> slowdown = argc > 3 ? legopt::ParseNumber(argv[3]) : 1.0;
  if (argc < 3 || argc > 4 || !slowdown || !(*slowdown >= 1.0)) {
    std::fprintf(stderr, "usage: simulate_motions DATASET SOLUTIONS.json [SLOWDOWN], SLOWDOWN >= 1\n");
    return kUsage;
  }
  try {
    return legopt::client::Simulate(argv[1], argv[2], *slowdown);
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "simulate_motions: %s\n", error.what());
    return kUsage;
  }
}
