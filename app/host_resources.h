#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace legopt::app {

/// Processors on which this thread may run, ascending; empty: unknown.
std::vector<int> AffinityMask();

/// Returns the first of `processors` on each physical core, in their order, because two processors of a core slow each
/// other down. Reads files below `root` (tests use their own tree). A processor without information counts as a core.
std::vector<int> OneOfEachCore(std::span<const int> processors, const std::filesystem::path& root = "/");

/// Returns the processor to which each of `slots` is pinned: one core per slot, if the slots use all granted cores.
/// Otherwise none is pinned (empty). With more cores than slots other programs may use some, and the kernel can choose.
/// With fewer cores than slots the slots share them.
std::vector<int> ProcessorsOfSlots(int slots, const std::vector<int>& cores);

/// Pins this thread to one processor during its lifetime; child processes started meanwhile inherit that. If the kernel
/// refuses because the grant has changed, the thread is not pinned. Thread rule: one thread.
class PinnedThread {
 public:
  explicit PinnedThread(int processor);
  ~PinnedThread();
  PinnedThread(const PinnedThread&) = delete;
  PinnedThread& operator=(const PinnedThread&) = delete;

 private:
  std::vector<int> before_;
};

/// Facts about the processors that this process may use. Empty: no such limit, or unknown.
struct ProcessorFacts {
  int machine = 1;              ///< online, >= 1
  std::optional<int> affinity;  ///< number in the affinity mask (taskset, cpusets, Slurm's task/affinity), >= 1
  std::optional<int> cores;     ///< number of their physical cores, >= 1, <= affinity
  std::optional<int> slurm_cpus_per_task;  ///< SLURM_CPUS_PER_TASK, >= 1: Slurm sets it for `-c N`
  std::optional<int> slurm_cpus_on_node;   ///< SLURM_CPUS_ON_NODE, >= 1: granted to the Slurm job here
  std::optional<double> cgroup_quota;      ///< processor seconds per second, > 0: containers, systemd's CPUQuota
};

/// Number of single-threaded jobs that this process may run concurrently, and the limit that determines it.
struct ProcessorGrant {
  int processors = 1;  ///< >= 1
  std::string reason;  ///< text for humans: "the affinity mask grants 1 of this machine's 2 processors"
};

/// Returns min(machine, affinity, Slurm, ceil(cgroup quota), cores). If both of Slurm's variables are set, the one per
/// task is used. Among equal limits the first in this list is the reason.
ProcessorGrant GrantedProcessors(const ProcessorFacts& facts);

/// Returns the smallest CPU quota of the control groups (version 1 and 2) of this process and of their parents. Reads
/// files below `root` (tests use their own tree). Unreadable files impose no limit.
std::optional<double> CgroupProcessorQuota(const std::filesystem::path& root);

/// Facts of this process. Invalid values of Slurm's variables are ignored.
ProcessorFacts ReadProcessorFacts();

/// Description of the machine, for measured times.
struct HostFacts {
  std::string processor;          ///< model as reported by the kernel; "unknown"
  std::int64_t memory_bytes = 0;  ///< memory of the machine; 0: unknown
};

/// Reads files below `root` (tests use their own tree).
HostFacts ReadHostFacts(const std::filesystem::path& root = "/");

/// Returns the load average: processes that run or wait to run, mean of the last minute, >= 0; NaN: unknown.
double HostLoad(const std::filesystem::path& root = "/");

}  // namespace legopt::app
