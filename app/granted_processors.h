#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::app {

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

}  // namespace legopt::app
