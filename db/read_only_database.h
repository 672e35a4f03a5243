#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "db/store_error.h"

namespace legopt::db {

struct Blob {
  std::string bytes;
  bool operator==(const Blob&) const = default;
};

/// An SQL value: NULL, INTEGER, REAL, TEXT (UTF-8) or BLOB.
using Value = std::variant<std::monostate, std::int64_t, double, std::string, Blob>;

struct QueryResult {
  std::vector<std::string> columns;
  std::vector<std::vector<Value>> rows;  ///< each has columns.size() values
  bool truncated = false;                ///< true if more rows exist than the limits allowed
};

/// Resource limits of a query. At the row or byte limit the result is truncated; at the time limit kInterrupted is
/// thrown.
struct QueryLimits {
  std::int64_t max_rows = 1'000'000;
  std::size_t max_bytes = std::size_t{256} << 20U;  ///< limit of the values held in memory
  std::chrono::milliseconds time_limit{60'000};     ///< 0: no limit
  bool time_is_per_row = false;  ///< apply the time limit to each row, so that long answers are not cut off
};

/// Receives the rows of a query one by one.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Called once, before the first row.
  virtual void Begin(const std::vector<std::string>& columns) = 0;
  virtual void Row(std::vector<Value> row) = 0;
};

class Connection;

/// Whether to check that the log beside a file was written for it (db/file_state.h).
enum class Log {
  kChecked,
  kTrusted,  ///< this process writes the database and has checked the log; another check would drop its locks
};

/// Opens a read-only connection; the database may be live. If the folder is not writable, or the file belongs to
/// another user and has no `-shm`, no side file is created: a log is read in a private copy. Throws StoreError:
/// kNotFound, kNotLegopt (not a file), kUnwritable (not readable), kCorrupt (damaged, or the log belongs to another
/// file), kFull (no space for the copy).
std::unique_ptr<Connection> OpenForReading(const std::filesystem::path& path, Log log = Log::kChecked);
/// Throws StoreError: kNotLegopt, kNewerSchema, kOlderSchema, kCorrupt (part of the schema is missing).
void RequireCurrentSchema(Connection& connection);
/// Checks the schema version without checking the schema's entries.
void RequireCurrentVersion(Connection& connection);

/// A legopt database opened for reading: live (a server may be writing to it), finished, or a backup.
///
/// Nothing can be changed: the connection is read-only and `query_only`, and an authorizer allows only SELECT (and the
/// table-valued functions of PRAGMAs that describe the schema). Data of a running server is visible as of its last
/// commit. Thread rule: one thread at a time, except Interrupt(). Not to be used across fork().
class ReadOnlyDatabase {
 public:
  /// Throws StoreError: kNotFound, kNotLegopt, kNewerSchema, kOlderSchema, kUnwritable (not readable), kCorrupt.
  explicit ReadOnlyDatabase(const std::filesystem::path& path, Log log = Log::kChecked);
  ~ReadOnlyDatabase();
  ReadOnlyDatabase(ReadOnlyDatabase&&) noexcept;
  ReadOnlyDatabase& operator=(ReadOnlyDatabase&&) noexcept;

  /// Runs one SELECT; `parameters` are bound to ?1, ?2, ...
  /// Throws StoreError: kBadQuery (with SQLite's message), kInterrupted, kBusy, kIo, kCorrupt.
  QueryResult Query(const std::string& sql, std::span<const Value> parameters = {}, const QueryLimits& limits = {});

  /// Runs one SELECT and passes each row to `sink`; no row is stored. Returns true if more rows exist than
  /// `limits.max_rows`; `limits.max_bytes` is ignored.
  bool Stream(const std::string& sql, const QueryLimits& limits, RowSink& sink);

  /// Runs one SELECT with a row limit and default limits otherwise.
  QueryResult Query(const std::string& sql, std::int64_t max_rows);

  /// Makes a Query running in another thread throw kInterrupted. No effect if none is running.
  void Interrupt();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::db
