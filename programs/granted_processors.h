#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::programs {

/// What the system says about the processors that this process may use. Empty: no such limit, or not known.
struct ProcessorFacts {
  int machine = 1;                         ///< online, >= 1
  std::optional<int> affinity;             ///< in the affinity mask (taskset, cpusets, Slurm's task/affinity), >= 1
  std::optional<int> cores;                ///< physical ones that these are on, >= 1, <= affinity
  std::optional<int> slurm_cpus_per_task;  ///< SLURM_CPUS_PER_TASK, >= 1: Slurm sets it for `-c N`
  std::optional<int> slurm_cpus_on_node;   ///< SLURM_CPUS_ON_NODE, >= 1: what the Slurm job has of this machine
  std::optional<double> cgroup_quota;      ///< processor seconds per second, > 0: containers, systemd's CPUQuota
};

/// How many jobs of one thread each this process may run side by side, and which limit says so.
struct ProcessorGrant {
  int processors = 1;  ///< >= 1
  std::string reason;  ///< for people: "the affinity mask grants 1 of this machine's 2 processors"
};

/// min(machine, affinity, Slurm, ceil(cgroup quota), cores); of Slurm's two variables the one per task, where both are
/// set. Of equal limits the first of this list gives the reason.
ProcessorGrant GrantedProcessors(const ProcessorFacts& facts);

/// The smallest CPU quota of the control groups, version 1 and 2, that this process is in, those above included. Files
/// are looked for below `root` (tests bring a tree of their own). What cannot be read is no limit.
std::optional<double> CgroupProcessorQuota(const std::filesystem::path& root);

/// The facts of this process. Values of Slurm's variables that are no numbers are as good as unset.
ProcessorFacts ReadProcessorFacts();

}  // namespace legopt::programs
