#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "db/records.h"
#include "legopt/types/job.h"
#include "legopt_msg/hello_request.hpp"

/// @file
/// Matching of jobs and workers: requirements of jobs and capabilities of workers. Thread rule: none, values.

namespace legopt::server {

/// A requirement of a job that its worker must satisfy.
struct JobRequirement {
  /// The first three kinds are announced as capabilities; the others are properties of every worker.
  enum class Kind : std::uint8_t { kDataset, kSolver, kCollision, kBuild, kMemory };

  Kind kind{};
  std::string name;        ///< name of a dataset, solver or collision model
  std::string hash;        ///< hash of a dataset or solver; id of a build
  std::int64_t bytes = 0;  ///< amount of memory

  bool operator==(const JobRequirement&) const = default;
};

/// Returns e.g. "dataset 'garage' (0123456789ab)", "solver 'mine' (6b4f8a0d)", "build ...", "1024 MB of memory".
std::string TextOf(const JobRequirement& need);
/// Returns how the user can satisfy the need, e.g. "start one with --solver".
std::string RemedyOf(const JobRequirement& need);

/// Capabilities of a worker, as announced by its hello.
class WorkerCapabilities {
 public:
  WorkerCapabilities() = default;
  explicit WorkerCapabilities(const legopt_msg::hello_request& hello);

  bool Has(const JobRequirement& need) const;
  /// True if the worker fetches missing datasets from the server.
  bool FetchesDatasets() const;
  /// Returns whether the worker would fetch the dataset with this content hash; false after a failed attempt.
  bool WouldFetch(const std::string& hash) const;

  /// Returns the names of one kind, in the order of announcement.
  std::vector<std::string> Names(CapabilityKind kind) const;
  /// Returns the hash of the capability with this kind and name; empty if missing.
  std::string HashOf(CapabilityKind kind, const std::string& name) const;
  /// False while the worker is loading its datasets.
  bool HasLoaded() const { return !Names(CapabilityKind::kDataset).empty(); }

  bool operator==(const WorkerCapabilities&) const = default;

 private:
  struct Capability {
    CapabilityKind kind{};
    std::string name, hash;
    bool operator==(const Capability&) const = default;
  };
  std::vector<Capability> capabilities_;
  std::string build_id_;
  std::int64_t memory_bytes_ = 0;  ///< 0: unknown, treated as sufficient
};

/// Returns the requirements that follow from a method's options: its external solver and its collision model.
std::vector<JobRequirement> NeedsOf(const db::MethodRecord& method);

}  // namespace legopt::server
