#include "db/read_only_database.h"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <utility>

#include "db/connection.h"
#include "db/file_state.h"
#include "db/migrations.h"
#include "legopt/files/written_file.h"
#include "legopt/types/nearest_name.h"

namespace legopt::db {
namespace {

using Clock = std::chrono::steady_clock;

// PRAGMAs that only describe the schema; also available as table-valued functions.
constexpr std::array<std::string_view, 6> kDescribing{"table_info", "table_xinfo", "table_list",
                                                      "index_list", "index_info",  "foreign_key_list"};

constexpr char kOnlySelect[] = "only SELECT is allowed here: the database is read-only";

// Called by SQLite while it compiles a statement. Denies every action that does not read.
int Authorize(void* /*context*/, int action, const char* first, const char* second, const char* /*database*/,
              const char* /*trigger*/) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
      return SQLITE_OK;
    case SQLITE_FUNCTION:
      return std::string_view(second == nullptr ? "" : second) == "load_extension" ? SQLITE_DENY : SQLITE_OK;
    case SQLITE_PRAGMA:
      return std::find(kDescribing.begin(), kDescribing.end(), std::string_view(first == nullptr ? "" : first)) !=
                     kDescribing.end()
                 ? SQLITE_OK
                 : SQLITE_DENY;
    default:
      return SQLITE_DENY;
  }
}

// Limits the machine resources that a statement can use.
void LimitResources(sqlite3* handle) {
  constexpr int kMaxValueBytes = kMaxMiBOfQueriedValue << 20;
  constexpr int kMaxSqlBytes = 100'000;
  constexpr int kMaxDepth = 200;
  constexpr int kMaxColumns = 500;
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  sqlite3_limit(handle, SQLITE_LIMIT_SQL_LENGTH, kMaxSqlBytes);
  sqlite3_limit(handle, SQLITE_LIMIT_EXPR_DEPTH, kMaxDepth);
  sqlite3_limit(handle, SQLITE_LIMIT_COMPOUND_SELECT, kMaxDepth);
  sqlite3_limit(handle, SQLITE_LIMIT_COLUMN, kMaxColumns);
  sqlite3_limit(handle, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_limit(handle, SQLITE_LIMIT_WORKER_THREADS, 0);
}

Value ValueOf(const Statement& statement, int column) {
  switch (statement.column_type(column)) {
    case Statement::Type::kInteger:
      return statement.column_int(column);
    case Statement::Type::kReal:
      return statement.column_double(column);
    case Statement::Type::kText:
      return statement.column_text(column);
    case Statement::Type::kBlob:
      return Blob{statement.column_text(column)};
    case Statement::Type::kNull:
      break;
  }
  return std::monostate{};
}

std::size_t BytesOf(const Value& value) {
  constexpr std::size_t kPerValue = 40;
  if (const auto* text = std::get_if<std::string>(&value)) return kPerValue + text->size();
  if (const auto* blob = std::get_if<Blob>(&value)) return kPerValue + blob->bytes.size();
  return kPerValue;
}

void BindValue(Statement& statement, int parameter, const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    statement.Bind(parameter, *integer);
  } else if (const auto* real = std::get_if<double>(&value)) {
    statement.Bind(parameter, *real);
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    statement.Bind(parameter, *text);
  } else if (const auto* blob = std::get_if<Blob>(&value)) {
    statement.BindBlob(parameter, blob->bytes.data(), blob->bytes.size());
  } else {
    statement.BindNull(parameter);
  }
}

// Errors name the path `shown`.
std::unique_ptr<Connection> OpenAndRead(const std::filesystem::path& path, const std::filesystem::path& shown) {
  auto connection = std::make_unique<Connection>(path, Connection::Mode::kReadOnly, shown);
  connection->QueryInt("PRAGMA user_version");  // the first read opens the side files
  return connection;
}

std::unique_ptr<Connection> OpenWithoutSideFiles(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(path, error);
  if (!std::filesystem::exists(real.string() + "-wal", error)) {
    return std::make_unique<Connection>(path, Connection::Mode::kImmutable);
  }
  const PrivateCopy copy(path);
  return OpenAndRead(copy.path(), path);
}

}  // namespace

std::unique_ptr<Connection> OpenForReading(const std::filesystem::path& path, Log log) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw StoreError(StoreErrorCode::kNotFound, path.string() + ": no such database; check the path");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw StoreError(StoreErrorCode::kNotLegopt, path.string() + ": not a file; name the database file");
  }
  if (::access(path.c_str(), R_OK) != 0) {
    throw StoreError(StoreErrorCode::kUnwritable, path.string() + ": cannot be read: " + files::Explain(errno));
  }
  if (log == Log::kChecked) RequireOwnLog(path);
  if (WouldLeaveSideFiles(path)) return OpenWithoutSideFiles(path);
  try {
    return OpenAndRead(path, path);
  } catch (const StoreError& e) {
    // Continue only if the folder is not writable, so that side files cannot be created.
    if (e.code() != StoreErrorCode::kUnwritable) throw;
    return OpenWithoutSideFiles(path);
  }
}

void RequireCurrentSchema(Connection& connection) {
  RequireCurrentVersion(connection);
  RequireIntact(connection);
}

void RequireCurrentVersion(Connection& connection) {
  const std::string file = connection.path().string();
  const Identity identity = Identify(connection);
  if (identity.empty) {
    throw StoreError(StoreErrorCode::kNotLegopt, file + ": empty, not a legopt database; check the path");
  }
  if (identity.version < SchemaVersion()) {
    throw StoreError(StoreErrorCode::kOlderSchema, file + ": written by an older legopt (schema " +
                                                       std::to_string(identity.version) +
                                                       "); start legopt-server --db on it once, it upgrades the file");
  }
}

class ReadOnlyDatabase::Impl {
 public:
  Impl(const std::filesystem::path& path, Log log) : connection_(OpenForReading(path, log)) {
    RequireCurrentSchema(*connection_);
    connection_->Execute("PRAGMA query_only = 1; PRAGMA cache_size = -16384");
    LimitResources(connection_->handle());
    // The first use of a PRAGMA creates its table-valued function, which the authorizer would reject as a change.
    for (const std::string_view pragma : kDescribing) {
      connection_->QueryText("SELECT 1 FROM pragma_" + std::string(pragma) + "('jobs')");
    }
    for (const std::string_view function : {"json_each", "json_tree"}) {
      connection_->QueryText("SELECT 1 FROM " + std::string(function) + "('[]')");
    }
    sqlite3_set_authorizer(connection_->handle(), Authorize, nullptr);
    constexpr int kInstructionsPerCheck = 100;  // a single instruction may take milliseconds, e.g. hex() of a large
                                                // value
    sqlite3_progress_handler(connection_->handle(), kInstructionsPerCheck, OnProgress, this);
  }

  QueryResult Query(const std::string& sql, std::span<const Value> parameters, const QueryLimits& limits) {
    QueryResult result;
    std::size_t bytes = 0;
    const auto begin = [&](std::vector<std::string> columns) { result.columns = std::move(columns); };
    const auto take = [&](std::vector<Value> row) {
      for (const Value& value : row) bytes += BytesOf(value);
      result.rows.push_back(std::move(row));
    };
    result.truncated = ForEachRow(sql, parameters, limits, begin, take, [&] { return bytes <= limits.max_bytes; });
    return result;
  }

  bool Stream(const std::string& sql, const QueryLimits& limits, RowSink& sink) {
    return ForEachRow(
        sql, {}, limits, [&](const std::vector<std::string>& columns) { sink.Begin(columns); },
        [&](std::vector<Value> row) { sink.Row(std::move(row)); }, [] { return true; });
  }

  void Interrupt() { connection_->Interrupt(); }

 private:
  // Returns true if there are more rows than the limits or `has_room` allow.
  template <class Begin, class Take, class HasRoom>
  bool ForEachRow(const std::string& sql, std::span<const Value> parameters, const QueryLimits& limits, Begin begin,
                  Take take, HasRoom has_room) {
    StartClock(limits);
    const char* tail = nullptr;
    RequireOneStatement(sql, &tail);
    Statement statement(*connection_, sql, false);
    if (!statement.read_only()) throw StoreError(StoreErrorCode::kBadQuery, kOnlySelect);
    int parameter = 0;
    for (const Value& value : parameters) BindValue(statement, ++parameter, value);
    std::vector<std::string> columns;
    for (int column = 0; column < statement.num_columns(); ++column) columns.push_back(statement.column_name(column));
    begin(std::move(columns));
    for (std::int64_t rows = 0; Step(statement, limits); ++rows) {
      if (rows >= limits.max_rows || !has_room()) return true;
      std::vector<Value> row;
      row.reserve(static_cast<std::size_t>(statement.num_columns()));
      for (int column = 0; column < statement.num_columns(); ++column) row.push_back(ValueOf(statement, column));
      take(std::move(row));
      if (limits.time_is_per_row) StartClock(limits);
    }
    return false;
  }

  void StartClock(const QueryLimits& limits) {
    const bool limited = limits.time_limit > limits.time_limit.zero();
    deadline_ = limited ? Clock::now() + limits.time_limit : Clock::time_point::max();
  }

  bool Step(Statement& statement, const QueryLimits& limits) const {
    try {
      return statement.Step();
    } catch (const StoreError& error) {
      if (error.code() != StoreErrorCode::kInterrupted || Clock::now() <= deadline_) throw;
      const auto tenths = limits.time_limit.count() / 100;
      throw StoreError(StoreErrorCode::kInterrupted, "the query was stopped after " + std::to_string(tenths / 10) +
                                                         "." + std::to_string(tenths % 10) +
                                                         " s; ask for less, or allow more with --limit SECONDS");
    }
  }

  static int OnProgress(void* self) { return Clock::now() > static_cast<Impl*>(self)->deadline_ ? 1 : 0; }

  std::vector<std::string> NamesOf(const std::string& type) {
    std::vector<std::string> names;
    Statement read(*connection_, "SELECT name FROM sqlite_schema WHERE type = '" + type + "' ORDER BY name", false);
    while (read.Step()) names.push_back(read.column_text(0));
    return names;
  }

  // For SQLite's "no such table: X": returns the most similar name and a list of all names.
  std::string TablesInsteadOf(const std::string& message) {
    constexpr std::string_view kUnknown = "no such table: ";
    if (!message.starts_with(kUnknown)) return {};
    std::vector<std::string> all = NamesOf("view");
    std::string text = "; views: ";
    for (const std::string& view : all) text += (view == all.front() ? "" : ", ") + view;
    const std::vector<std::string> tables = NamesOf("table");
    text += "; tables: ";
    for (const std::string& table : tables) text += (table == tables.front() ? "" : ", ") + table;
    all.insert(all.end(), tables.begin(), tables.end());
    return "; did you mean '" + NearestName(message.substr(kUnknown.size()), all) + "'?" + text.substr(1);
  }

  // SQLite would silently ignore a second statement; throw instead.
  void RequireOneStatement(const std::string& sql, const char** tail) {
    sqlite3_stmt* first = nullptr;
    const int code = sqlite3_prepare_v2(connection_->handle(), sql.c_str(), -1, &first, tail);
    const bool empty = first == nullptr;
    sqlite3_finalize(first);
    if (code == SQLITE_AUTH) {
      throw StoreError(StoreErrorCode::kBadQuery, kOnlySelect);
    }
    if (code != SQLITE_OK) {
      const std::string message = sqlite3_errmsg(connection_->handle());
      if (code == SQLITE_INTERRUPT) throw StoreError(StoreErrorCode::kInterrupted, "interrupted");
      throw StoreError(StoreErrorCode::kBadQuery, "bad SQL: " + message + TablesInsteadOf(message));
    }
    sqlite3_stmt* second = nullptr;
    const int second_code = sqlite3_prepare_v2(connection_->handle(), *tail, -1, &second, nullptr);
    sqlite3_finalize(second);
    if (second_code == SQLITE_INTERRUPT) throw StoreError(StoreErrorCode::kInterrupted, "interrupted");
    if (empty || second != nullptr || second_code != SQLITE_OK) {
      throw StoreError(StoreErrorCode::kBadQuery, empty ? "empty SQL" : "one statement at a time, please");
    }
  }

  std::unique_ptr<Connection> connection_;
  Clock::time_point deadline_;
};

ReadOnlyDatabase::ReadOnlyDatabase(const std::filesystem::path& path, Log log)
    : impl_(std::make_unique<Impl>(path, log)) {}
ReadOnlyDatabase::~ReadOnlyDatabase() = default;
ReadOnlyDatabase::ReadOnlyDatabase(ReadOnlyDatabase&&) noexcept = default;
ReadOnlyDatabase& ReadOnlyDatabase::operator=(ReadOnlyDatabase&&) noexcept = default;

QueryResult ReadOnlyDatabase::Query(const std::string& sql, std::span<const Value> parameters,
                                    const QueryLimits& limits) {
  return impl_->Query(sql, parameters, limits);
}

bool ReadOnlyDatabase::Stream(const std::string& sql, const QueryLimits& limits, RowSink& sink) {
  return impl_->Stream(sql, limits, sink);
}

QueryResult ReadOnlyDatabase::Query(const std::string& sql, std::int64_t max_rows) {
  QueryLimits limits;
  limits.max_rows = max_rows;
  return impl_->Query(sql, {}, limits);
}

void ReadOnlyDatabase::Interrupt() { impl_->Interrupt(); }

}  // namespace legopt::db
