#include "server/budget.h"

#include <algorithm>

#include "server/scheduler.h"

namespace legopt::server {

// Limits of the state that requests leave behind: rows, disk and memory.

namespace {

constexpr std::int64_t kBytesPerMegabyte = 1'000'000;
constexpr std::int64_t kBytesPerMebibyte = 1 << 20;

// Disk space of a queued job: its row, in the file and in the log.
constexpr std::int64_t kDiskBytesOfJob = 150;
// Disk space of an experiment without its jobs, per byte of its specification.
constexpr std::int64_t kDiskBytesOfSpecByte = 4;
constexpr std::int64_t kDiskBytesOfExperiment = 65'536;

std::string MegabytesOf(std::int64_t bytes) { return std::to_string(bytes / kBytesPerMegabyte) + " MB"; }
std::string MebibytesOf(std::size_t bytes) {
  return std::to_string(static_cast<std::int64_t>(bytes) / kBytesPerMebibyte) + " MiB";
}

}  // namespace

std::size_t SummaryBytes(const db::ExperimentSummary& summary) {
  constexpr std::size_t kFixed = 640;  // the summary, its submission id and their nodes
  constexpr std::size_t kNode = 64;    // size of a list element
  std::size_t bytes = kFixed + summary.name.size() + summary.submission_id.size() + summary.submitter.size() +
                      summary.dataset.size() + summary.control.reason.size();
  for (const std::string& method : summary.methods) bytes += kNode + method.size();
  for (const std::string& tag : summary.tags) bytes += kNode + tag.size();
  return bytes;
}

// Returns which limit the submission would exceed, with the numbers; empty if none.
std::string Scheduler::OverBudget(const ExperimentSpec& spec) const {
  if (std::ssize(summaries_) >= options_.max_experiments) {
    return "the server stores " + std::to_string(summaries_.size()) + " experiments and takes at most " +
           std::to_string(options_.max_experiments) + "; delete some ('legopt service delete')";
  }
  if (summary_bytes_ >= options_.max_summary_bytes) {
    return "the names, methods and tags of " + std::to_string(summaries_.size()) + " stored experiments take " +
           MebibytesOf(options_.max_summary_bytes) + ", which is the most; delete some ('legopt service delete')";
  }
  const std::int64_t open_jobs = num_queued() + num_leases();
  if (open_jobs + spec.num_jobs() > options_.max_open_jobs) {
    return "the server has " + std::to_string(open_jobs) + " open jobs and takes at most " +
           std::to_string(options_.max_open_jobs) + "; submit again later";
  }
  if (std::string why = OverBudgetInMemory(spec); !why.empty()) return why;
  return OverDiskReserve(spec);
}

// Experiments that have just ended are counted: they stay in memory until the end of `retention`.
std::string Scheduler::OverBudgetInMemory(const ExperimentSpec& spec) const {
  struct Use {
    std::int64_t experiments = 0, jobs = 0;
    std::size_t spec_bytes = 0;
  };
  Use all, own;
  std::int64_t own_open_jobs = 0;
  for (const auto& [id, experiment] : open_) {
    const db::ExperimentSummary& summary = summaries_.at(id);
    for (Use* use : {&all, summary.submitter == spec.submitter ? &own : nullptr}) {
      if (use == nullptr) continue;
      ++use->experiments;
      use->jobs += summary.num_jobs;
      use->spec_bytes += experiment->spec().canonical_json.size();
    }
    if (summary.state != db::ExperimentState::kActive || summary.submitter != spec.submitter) continue;
    own_open_jobs += summary.jobs_by_state[db::JobState::kQueued] + summary.jobs_by_state[db::JobState::kLeased];
  }
  const std::string submitter = "submitter '" + spec.submitter + "'";
  const std::string of_one = " of one submitter; submit again later";
  if (own_open_jobs + spec.num_jobs() > options_.max_open_jobs_per_submitter) {
    return submitter + " has " + std::to_string(own_open_jobs) + " open jobs, and the server takes at most " +
           std::to_string(options_.max_open_jobs_per_submitter) + of_one;
  }
  if (own.experiments >= options_.max_open_experiments_per_submitter) {
    return submitter + " has " + std::to_string(own.experiments) + " open experiments, and the server takes at most " +
           std::to_string(options_.max_open_experiments_per_submitter) + of_one;
  }
  if (own.spec_bytes + spec.canonical_json.size() > options_.max_spec_bytes_per_submitter) {
    return "the specifications of " + submitter + " have " + MebibytesOf(own.spec_bytes) +
           ", and the server takes at most " + MebibytesOf(options_.max_spec_bytes_per_submitter) + of_one;
  }
  if (all.experiments >= options_.max_open_experiments) {
    return "the server has " + std::to_string(all.experiments) + " open experiments and takes at most " +
           std::to_string(options_.max_open_experiments) + "; submit again later";
  }
  if (all.spec_bytes + spec.canonical_json.size() > options_.max_spec_bytes) {
    return "the specifications of open experiments have " + MebibytesOf(all.spec_bytes) +
           ", and the server takes at most " + MebibytesOf(options_.max_spec_bytes) + "; submit again later";
  }
  if (all.jobs + spec.num_jobs() > options_.max_jobs_in_memory) {
    return "the server has " + std::to_string(all.jobs) + " jobs of open and just ended experiments in memory and " +
           "takes at most " + std::to_string(options_.max_jobs_in_memory) + "; submit again in a minute";
  }
  return {};
}

std::string Scheduler::OverDiskReserve(const ExperimentSpec& spec) const {
  const std::optional<db::DiskSpace> disk = lookup_.disk_space ? lookup_.disk_space() : std::nullopt;
  if (!disk) return {};
  const std::int64_t reserve = ReserveOf(*disk, options_.disk_reserve_bytes);
  const std::int64_t needed = kDiskBytesOfExperiment + spec.num_jobs() * kDiskBytesOfJob +
                              static_cast<std::int64_t>(spec.canonical_json.size()) * kDiskBytesOfSpecByte;
  if (disk->free_bytes - needed >= reserve) return {};
  return "the disk with the database has " + MegabytesOf(disk->free_bytes) + " free; the experiment's " +
         std::to_string(spec.num_jobs()) + " jobs need about " + MegabytesOf(needed) + ", and " + MegabytesOf(reserve) +
         " are reserved for the results of accepted jobs; free some space, or use a database on another disk";
}

std::int64_t ReserveOf(const db::DiskSpace& disk, std::int64_t reserve_bytes) {
  return std::min(reserve_bytes, static_cast<std::int64_t>(static_cast<double>(disk.total_bytes) * kMaxReservedShare));
}

// Limits requests that add an event to the database.
std::string Scheduler::OverControlRate(const Instant& now) {
  if (controls_.Take(now.steady)) return {};
  return "the server has recorded many changes of experiments in a short time; try again in a second";
}

}  // namespace legopt::server
