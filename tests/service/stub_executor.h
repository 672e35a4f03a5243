#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "worker/job_executor.h"

namespace legopt::worker {

/// Executes jobs without numerics, to test their transport. A dataset "folder" is just a name and a hexadecimal digit,
/// "NAME-d": its content hash is 64 times the digit. Method options: {"work_ms": duration of a job, default 0;
/// "work_spread_ms": maximum additional time, depending on the problem, default 0; "crash_problem": id of a problem
/// whose job aborts, default none; "stop_problem": id of a problem whose first attempt reports a stop by the wall-time
/// limit, default none; "waypoints": rows of the solution, default 1; "windows" and "windows_solved": reported for a
/// motion, default none}. Progress counts milliseconds of work.
class StubExecutor final : public JobExecutor {
 public:
  explicit StubExecutor(std::vector<std::filesystem::path> folders) : folders_(std::move(folders)) {}

  std::vector<Capability> Load() override;
  legopt_msg::result_request Execute(const legopt_msg::lease& job, std::string_view options_json,
                                     const Hooks& hooks) override;

  /// Returns the 36 numbers per waypoint that every attempt at this job must give.
  static std::vector<double> Solution(std::int64_t seed, int problem_id, int repetition, int waypoints = 1);

 private:
  std::vector<std::filesystem::path> folders_;
};

}  // namespace legopt::worker
