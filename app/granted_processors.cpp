#include "app/granted_processors.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string_view>
#include <vector>

#include "app/affinity.h"
#include "legopt/types/classic_stream.h"

namespace legopt::app {
namespace {

std::optional<int> PositiveNumber(const char* text) {
  if (text == nullptr) return std::nullopt;
  const std::string_view view = text;
  int value = 0;
  const auto [end, error] = std::from_chars(view.data(), view.data() + view.size(), value);
  if (error != std::errc{} || end != view.data() + view.size() || value < 1) return std::nullopt;
  return value;
}

// --- Control groups --------------------------------------------------------------------------------------------------

bool ListHas(const std::string& list, std::string_view word) {
  ClassicInput words(list);
  for (std::string each; std::getline(words, each, ',');) {
    if (each == word) return true;
  }
  return false;
}

// Returns the control group of this process by hierarchy: "cpu" of version 1, "" for version 2. Reads lines
// "4:cpu,cpuacct:/path".
std::map<std::string, std::string> GroupPaths(const std::filesystem::path& root) {
  std::map<std::string, std::string> paths;
  std::ifstream file(root / "proc/self/cgroup");
  for (std::string line; std::getline(file, line);) {
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (controllers.empty()) paths[""] = line.substr(second + 1);
    if (ListHas(controllers, "cpu")) paths["cpu"] = line.substr(second + 1);
  }
  return paths;
}

struct GroupMount {
  std::string hierarchy;  // see GroupPaths
  std::string group;      // mounted group
  std::string folder;     // mount point
};

// Parses lines "30 22 0:27 GROUP FOLDER rw ... - TYPE SOURCE OPTIONS" for mounts of control groups.
std::vector<GroupMount> GroupMounts(const std::filesystem::path& root) {
  std::vector<GroupMount> mounts;
  std::ifstream file(root / "proc/self/mountinfo");
  for (std::string line; std::getline(file, line);) {
    const auto separator = line.find(" - ");
    if (separator == std::string::npos) continue;
    ClassicInput before(line.substr(0, separator));
    ClassicInput after(line.substr(separator + 3));
    std::string skipped;
    std::string type;
    std::string options;
    GroupMount mount;
    before >> skipped >> skipped >> skipped >> mount.group >> mount.folder;
    after >> type >> skipped >> options;
    if (type == "cgroup" && ListHas(options, "cpu")) mount.hierarchy = "cpu";
    if (type == "cgroup2" || !mount.hierarchy.empty()) mounts.push_back(mount);
  }
  return mounts;
}

std::optional<double> QuotaOf(const std::filesystem::path& group) {
  double quota = 0;
  double period = 0;
  if (std::ifstream both(group / "cpu.max"); both) {  // version 2: "250000 100000", or "max 100000"
    both >> quota >> period;
    if (!both) return std::nullopt;
  } else {  // version 1: -1 if there is no quota
    std::ifstream(group / "cpu.cfs_quota_us") >> quota;
    std::ifstream(group / "cpu.cfs_period_us") >> period;
  }
  return quota > 0 && period > 0 ? std::optional(quota / period) : std::nullopt;
}

// Returns the group's folder below the mount. In a container the mount may begin at the group itself.
std::filesystem::path FolderBelow(const GroupMount& mount, const std::string& group) {
  if (group.find("/..") != std::string::npos) return {};  // outside of the mounted part
  const std::string prefix = mount.group == "/" ? "" : mount.group;
  if (group.rfind(prefix, 0) != 0) return {};
  return std::filesystem::path(group.substr(prefix.size())).relative_path();
}

}  // namespace

std::optional<double> CgroupProcessorQuota(const std::filesystem::path& root) {
  const std::map<std::string, std::string> groups = GroupPaths(root);
  std::optional<double> smallest;
  for (const GroupMount& mount : GroupMounts(root)) {
    const auto group = groups.find(mount.hierarchy);
    if (group == groups.end()) continue;
    const std::filesystem::path top = root / std::filesystem::path(mount.folder).relative_path();
    for (std::filesystem::path below = FolderBelow(mount, group->second);; below = below.parent_path()) {
      if (const auto quota = QuotaOf(top / below); quota && (!smallest || *quota < *smallest)) smallest = quota;
      if (below.empty()) break;
    }
  }
  return smallest;
}

ProcessorFacts ReadProcessorFacts() {
  ProcessorFacts facts;
  facts.machine = static_cast<int>(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)));
  if (const std::vector<int> mask = AffinityMask(); !mask.empty()) {
    facts.affinity = static_cast<int>(mask.size());
    facts.cores = static_cast<int>(OneOfEachCore(mask).size());
  }
  facts.slurm_cpus_per_task = PositiveNumber(std::getenv("SLURM_CPUS_PER_TASK"));
  facts.slurm_cpus_on_node = PositiveNumber(std::getenv("SLURM_CPUS_ON_NODE"));
  facts.cgroup_quota = CgroupProcessorQuota("/");
  return facts;
}

ProcessorGrant GrantedProcessors(const ProcessorFacts& facts) {
  struct Limit {
    std::string name;
    int processors;
  };
  std::vector<Limit> limits;
  if (facts.affinity) limits.push_back({"the affinity mask", *facts.affinity});
  if (facts.slurm_cpus_per_task) {
    limits.push_back({"SLURM_CPUS_PER_TASK", *facts.slurm_cpus_per_task});
  } else if (facts.slurm_cpus_on_node) {
    limits.push_back({"SLURM_CPUS_ON_NODE", *facts.slurm_cpus_on_node});
  }
  if (facts.cgroup_quota) {
    const double whole = std::clamp(std::ceil(*facts.cgroup_quota), 1.0, static_cast<double>(facts.machine));
    limits.push_back({"the control group's CPU quota", static_cast<int>(whole)});
  }
  if (facts.cores) limits.push_back({"one to a physical core", *facts.cores});
  const std::string all = std::to_string(facts.machine) + (facts.machine == 1 ? " processor" : " processors");
  ProcessorGrant grant{facts.machine, "this machine has " + all};
  for (const Limit& limit : limits) {
    if (limit.processors >= grant.processors) continue;
    grant.processors = std::max(1, limit.processors);
    grant.reason = limit.name + " grants " + std::to_string(grant.processors) + " of this machine's " + all;
  }
  return grant;
}

}  // namespace legopt::app
