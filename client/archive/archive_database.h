#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>

#include "client/archive/archive.h"
#include "client/archive/archive_judge.h"
#include "db/store.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Returns the ids of an archive's jobs in a database that has no other archive. They are numbered from 1 by method,
/// task, initialization, problem and repetition, in the archive's order.
std::map<JobKey, std::int64_t> JobIds(const Archive& archive);

/// Writes judged archives to a new results database, an experiment each, so that every command that reads results can
/// read them. Verdicts and costs are those of the judgement; times and work are the archives' claims. An archive does
/// not state limits of time and effort: the database has the defaults of the tasks. A job without a result is failed.
/// Not thread-safe.
class ArchiveDatabase {
 public:
  /// Begins an empty database in a temporary folder. Throws FileError and db::StoreError.
  ArchiveDatabase();
  ~ArchiveDatabase();
  ArchiveDatabase(const ArchiveDatabase&) = delete;
  ArchiveDatabase& operator=(const ArchiveDatabase&) = delete;

  /// Adds an archive with its dataset. `judged` must be its judgement. Returns the id of the experiment: 1, 2, ...
  /// Throws InputError if the dataset lacks a problem or a result contradicts itself, and db::StoreError.
  std::int64_t Add(const Archive& archive, const JudgedArchive& judged, const Dataset& dataset);

  /// Writes the database to `file`, which must not exist. Throws db::StoreError. Nothing can be added afterwards.
  void Finish(const std::filesystem::path& file);

 private:
  std::filesystem::path folder_;
  std::unique_ptr<db::Store> store_;
};

}  // namespace legopt::client
