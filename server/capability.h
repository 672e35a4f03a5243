#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "db/records.h"
#include "legopt_msg/hello_request.hpp"
#include "words/capability.h"

/// @file
/// Matching of jobs and workers: what the jobs of a method need, what a worker has. Thread rule: none, values.

namespace legopt::server {

/// Something that a job needs of its worker.
struct Need {
  /// What kind of thing it is. The first three are announced as capabilities, the others are facts of every worker.
  enum class Kind : std::uint8_t { kDataset, kSolver, kCollision, kBuild, kMemory };

  Kind kind{};
  std::string name;        ///< of a dataset or solver; the word of a collision model
  std::string hash;        ///< of a dataset or solver; the id of a build
  std::int64_t bytes = 0;  ///< of memory

  bool operator==(const Need&) const = default;
};

/// "dataset 'garage' (0123456789ab)", "solver 'mine' (6b4f8a0d)", "build ...", "1024 MB of memory".
std::string TextOf(const Need& need);
/// What a person does to provide it: "start one with --solver".
std::string CureOf(const Need& need);

/// What a worker has, as its hello announces it.
class Abilities {
 public:
  Abilities() = default;
  explicit Abilities(const legopt_msg::hello_request& hello);

  bool Has(const Need& need) const;
  /// Whether the worker fetches datasets that it does not have from the server.
  bool FetchesDatasets() const;
  /// Whether the worker would fetch the dataset with this content hash: false after a try that failed.
  bool WouldFetch(const std::string& hash) const;

  /// Names of one kind, in the order in which they were announced.
  std::vector<std::string> Names(CapabilityKind kind) const;
  /// Hash of the thing of that kind and name; empty when it has none.
  std::string HashOf(CapabilityKind kind, const std::string& name) const;
  /// False for a worker that still loads its datasets.
  bool HasLoaded() const { return !Names(CapabilityKind::kDataset).empty(); }

  bool operator==(const Abilities&) const = default;

 private:
  struct Capability {
    CapabilityKind kind{};
    std::string name, hash;
    bool operator==(const Capability&) const = default;
  };
  std::vector<Capability> capabilities_;
  std::string build_id_;
  std::int64_t memory_bytes_ = 0;  ///< 0: unknown, taken for enough
};

/// What jobs of a method need: its external solver and its collision model, as far as its options name them.
std::vector<Need> NeedsOf(const db::MethodRecord& method);

}  // namespace legopt::server
