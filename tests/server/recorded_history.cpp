#include "tests/server/recorded_history.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "tests/folders.h"

namespace legopt::server {

RecordedHistory ReadHistory(const std::string& file) {
  std::ifstream in(SourceFolder() + "/tests/server/histories/" + file);
  std::string line;
  if (!std::getline(in, line)) throw std::runtime_error(file + " cannot be read");
  RecordedHistory history;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> kinds;
  std::map<std::string, std::size_t> methods;
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string method, task, initialization, waypoints, wall_us, windows;
    std::getline(fields, method, ',');
    std::getline(fields, task, ',');
    std::getline(fields, initialization, ',');
    std::getline(fields, waypoints, ',');
    std::getline(fields, wall_us, ',');
    std::getline(fields, windows, ',');
    const std::size_t method_index = methods.emplace(method, methods.size()).first->second;
    const auto [kind, is_new] = kinds.emplace(std::tuple(method, task, initialization), kinds.size());
    if (is_new) history.kinds.push_back({method_index, ParseEnum<Task>(task).value(), 0, 0});
    history.jobs.push_back({kind->second, std::stod(waypoints), std::stod(wall_us) * 1e-6, std::stoi(windows)});
  }
  return history;
}

std::vector<ReplayedJob> AssignToSlots(const std::vector<RecordedJob>& jobs, int slots) {
  std::vector<double> free_at(static_cast<std::size_t>(slots));
  std::vector<ReplayedJob> replayed;
  for (const RecordedJob& job : jobs) {
    double& slot = *std::min_element(free_at.begin(), free_at.end());
    replayed.push_back({slot, slot + job.wall_s});
    slot += job.wall_s;
  }
  return replayed;
}

WorkLeft RemainingWorkAt(const RecordedHistory& history, const std::vector<ReplayedJob>& jobs, double now_s,
                         int slots) {
  constexpr double kLimit_s = 300;
  WorkLeft left;
  left.kinds = history.kinds;
  left.slots = slots;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const RecordedJob& job = history.jobs[i];
    if (jobs[i].end_s <= now_s) {
      left.kinds[job.kind].seconds += job.wall_s;
      left.kinds[job.kind].waypoints += job.waypoints;
    } else if (jobs[i].begin_s <= now_s) {
      const double elapsed_s = now_s - jobs[i].begin_s;
      const int solved = static_cast<int>(elapsed_s / job.wall_s * job.windows);
      left.running.push_back({job.kind, job.waypoints, elapsed_s, solved, job.windows, kLimit_s});
    } else {
      left.queued.push_back({job.kind, job.waypoints, 1});
    }
  }
  return left;
}

}  // namespace legopt::server
