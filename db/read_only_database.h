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

/// One SQL value: NULL, INTEGER, REAL, TEXT (UTF-8) or BLOB.
using Value = std::variant<std::monostate, std::int64_t, double, std::string, Blob>;

struct QueryResult {
  std::vector<std::string> columns;
  std::vector<std::vector<Value>> rows;  ///< each as long as `columns`
  bool truncated = false;                ///< true: more rows existed than the limits allowed
};

/// What one query may cost. Reaching rows or bytes truncates; reaching the time limit is a kInterrupted error.
struct QueryLimits {
  std::int64_t max_rows = 1'000'000;
  std::size_t max_bytes = std::size_t{256} << 20U;  ///< of values held in memory
  std::chrono::milliseconds time_limit{60'000};     ///< 0: none
  bool time_is_per_row =
      false;  ///< the time limit is that of each row, so that a long answer takes as long as it needs
};

/// Takes the rows of a query one after the other.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Called once, before the first row.
  virtual void Begin(const std::vector<std::string>& columns) = 0;
  virtual void Row(std::vector<Value> row) = 0;
};

class Connection;

/// Whether it has to be checked that the log beside a file was written for it (db/file_state.h).
enum class Log {
  kChecked,
  kTrusted,  ///< this process writes the database: it has checked the log, and a check would drop its locks
};

/// A read-only connection, also to a live database. If the folder cannot be written, or the file belongs to another
/// user and has no `-shm` yet, no side file is created: a log is read in a private copy. Throws StoreError: kNotFound,
/// kNotLegopt (not a file), kUnwritable (not readable), kCorrupt (damaged, or the log is of another file), kFull (no
/// room for the copy).
std::unique_ptr<Connection> OpenForReading(const std::filesystem::path& path, Log log = Log::kChecked);
/// Throws StoreError: kNotLegopt, kNewerSchema, kOlderSchema, kCorrupt (something of the schema is missing).
void RequireCurrentSchema(Connection& connection);
/// The same without a look at what the schema has.
void RequireCurrentVersion(Connection& connection);

/// A legopt database opened for reading: live (a server may be writing to it), finished, or a backup.
///
/// Nothing can be changed through it: the connection is read-only, `query_only`, and an authorizer admits nothing but
/// SELECT (and the PRAGMAs that describe the schema, as table-valued functions). Data of a running server is seen as of
/// the last commit. Thread rule: one thread at a time, except Interrupt(). Not to be used across fork().
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

  /// The same, row by row: no row is kept. True: more rows existed than `limits.max_rows`; its bytes do not count.
  bool Stream(const std::string& sql, const QueryLimits& limits, RowSink& sink);

  /// The same with a row limit only.
  QueryResult Query(const std::string& sql, std::int64_t max_rows);

  /// Makes a running Query of another thread throw kInterrupted. No effect when none runs.
  void Interrupt();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::db
