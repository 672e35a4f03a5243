#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Problems of a tier: a dataset and tasks of it.
struct BenchmarkSet {
  std::string dataset;  ///< name
  std::string hash;     ///< content hash, 64 hex digits
  std::vector<Task> tasks;
};

/// A part of the benchmark that is scored alone.
struct BenchmarkTier {
  std::string id;  ///< lower-case letters, digits and "-"
  std::string title, question;
  Rule rule = Rule::kPhysical;  ///< rule that counts successes
  bool infeasible = false;      ///< proven infeasible: a success here is a defect of the judge or of the proof
  std::vector<BenchmarkSet> sets;
};

/// Archives belong to the tier that has their dataset and task, whatever their own rule.
struct Benchmark {
  std::string name, edition, about;
  std::vector<BenchmarkTier> tiers;
};

/// Reads the definition of a benchmark (format: docs/reference/benchmark.md). Throws InputError with FILE:LINE, key and
/// remedy for unknown or missing keys, a hash or rule that is none, and a dataset and task in two tiers.
Benchmark ReadBenchmark(const std::filesystem::path& file);

/// Returns the embedded definition, DataFolder()/benchmark.yaml. Throws InputError if there is no data folder.
std::filesystem::path EmbeddedBenchmark();

}  // namespace legopt::client
