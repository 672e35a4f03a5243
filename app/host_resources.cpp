#include "app/host_resources.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <new>
#include <set>
#include <string_view>
#include <vector>

#include "legopt/types/number_text.h"

namespace legopt::app {
namespace {

// The kernel rejects a mask smaller than its own, e.g. on machines with more than 1024 processors.
constexpr int kFirstSize = 1024, kLastSize = 1 << 20;

class Mask {
 public:
  explicit Mask(int processors)
      : bytes_(CPU_ALLOC_SIZE(static_cast<std::size_t>(processors))),
        set_(CPU_ALLOC(static_cast<std::size_t>(processors))) {
    if (set_ == nullptr) throw std::bad_alloc();
    CPU_ZERO_S(bytes_, set_);
  }
  ~Mask() { CPU_FREE(set_); }
  Mask(const Mask&) = delete;
  Mask& operator=(const Mask&) = delete;

  bool Read() { return sched_getaffinity(0, bytes_, set_) == 0; }
  void Apply() const { sched_setaffinity(0, bytes_, set_); }
  bool Has(int processor) const { return CPU_ISSET_S(static_cast<std::size_t>(processor), bytes_, set_); }
  void Add(int processor) { CPU_SET_S(static_cast<std::size_t>(processor), bytes_, set_); }

 private:
  std::size_t bytes_;
  cpu_set_t* set_;
};

void RunOn(std::span<const int> processors) {
  Mask mask(std::max(kFirstSize, processors.back() + 1));
  for (const int processor : processors) mask.Add(processor);
  mask.Apply();
}

}  // namespace

std::vector<int> AffinityMask() {
  std::vector<int> processors;
  for (int size = kFirstSize; size <= kLastSize; size *= 2) {
    Mask mask(size);
    if (!mask.Read()) continue;
    for (int i = 0; i < size; ++i) {
      if (mask.Has(i)) processors.push_back(i);
    }
    break;
  }
  return processors;
}

std::vector<int> OneOfEachCore(std::span<const int> processors, const std::filesystem::path& root) {
  std::vector<int> cores;
  std::set<std::string> seen;  // lists of processors that share a core, as written by the kernel
  for (const int processor : processors) {
    const std::string folder = "sys/devices/system/cpu/cpu" + std::to_string(processor);
    std::string siblings;
    std::getline(std::ifstream(root / folder / "topology/thread_siblings_list"), siblings);
    if (siblings.empty() || seen.insert(siblings).second) cores.push_back(processor);
  }
  return cores;
}

std::vector<int> ProcessorsOfSlots(int slots, const std::vector<int>& cores) {
  return static_cast<std::size_t>(slots) == cores.size() ? cores : std::vector<int>{};
}

PinnedThread::PinnedThread(int processor) : before_(AffinityMask()) {
  const std::vector<int> one = {processor};
  RunOn(one);
}

PinnedThread::~PinnedThread() {
  if (!before_.empty()) RunOn(before_);
}

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

namespace {

// Returns the value of the first line "name<tabs>: value" with this name; empty if there is none.
std::string ValueOf(const std::filesystem::path& file, std::string_view name) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, name.size(), name) != 0) continue;
    const std::size_t value = line.find_first_not_of(" \t", line.find(':') + 1);
    if (line.find(':') != std::string::npos && value != std::string::npos) return line.substr(value);
  }
  return {};
}

}  // namespace

HostFacts ReadHostFacts(const std::filesystem::path& root) {
  constexpr std::int64_t kKibibyte = 1024;
  HostFacts facts;
  facts.processor = ValueOf(root / "proc/cpuinfo", "model name");
  if (facts.processor.empty()) facts.processor = "unknown";
  std::int64_t kibibytes = 0;
  ClassicInput(ValueOf(root / "proc/meminfo", "MemTotal")) >> kibibytes;
  facts.memory_bytes = kibibytes * kKibibyte;
  return facts;
}

double HostLoad(const std::filesystem::path& root) {
  double load = 0;
  std::ifstream file(root / "proc/loadavg");
  return file >> load && load >= 0 ? load : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace legopt::app
