#include "db/connection.h"

#include <sqlite3.h>
#include <sys/resource.h>

#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "legopt/files/written_file.h"

namespace legopt::db {
namespace {

struct Meaning {
  StoreErrorCode code;
  std::string advice;
};

// Returns the errno of a failed file operation; 0 if the error has none.
int SystemErrorOf(sqlite3* handle, int primary) {
  const bool of_a_file = primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN || primary == SQLITE_FULL;
  return handle != nullptr && of_a_file ? sqlite3_system_errno(handle) : 0;
}

// SQLite's rollback overwrites the errno of the failed write. Therefore this compares file sizes: one of the database's
// files is as large as the process may make it.
bool ReachedFileSizeLimit(sqlite3* handle) {
  constexpr std::uintmax_t kLargestStep = std::uintmax_t{1} << 16U;  // largest growth of a file by one SQLite write
  rlimit limit{};
  const char* file = handle == nullptr ? nullptr : sqlite3_db_filename(handle, "main");
  if (file == nullptr || ::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return false;
  const auto is_at_limit = [&](const char* suffix) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(std::string(file) + suffix, error);
    return limit.rlim_cur < kLargestStep || (!error && size + kLargestStep > limit.rlim_cur);
  };
  return is_at_limit("") || is_at_limit("-wal") || is_at_limit("-shm") || is_at_limit("-journal");
}

// Maps a primary result code to a StoreError code. Extended codes share its low byte.
Meaning MeaningOf(sqlite3* handle, int code) {
  constexpr int kPrimaryMask = 0xff;
  const int system_error = SystemErrorOf(handle, code & kPrimaryMask);
  if (files::IsShortage(system_error)) return {StoreErrorCode::kShortage, files::Explain(system_error)};
  const bool may_be_a_write = (code & kPrimaryMask) == SQLITE_IOERR || (code & kPrimaryMask) == SQLITE_FULL;
  if (may_be_a_write && (system_error == EFBIG || ReachedFileSizeLimit(handle))) {
    return {StoreErrorCode::kUnwritable, files::Explain(EFBIG)};
  }
  switch (code & kPrimaryMask) {
    case SQLITE_NOMEM:
      return {StoreErrorCode::kShortage, "give the program more memory"};
    case SQLITE_FULL:
      return {StoreErrorCode::kFull, files::WriteAdvice("free space on the disk")};
    case SQLITE_IOERR:
    case SQLITE_NOLFS:
    case SQLITE_PROTOCOL:
      return {StoreErrorCode::kIo, files::WriteAdvice("check the disk: its space and quota, its kernel messages")};
    case SQLITE_CORRUPT:
      return {StoreErrorCode::kCorrupt, "restore a backup: 'legopt service restore BACKUP --db FILE'"};
    case SQLITE_NOTADB:
      return {StoreErrorCode::kNotLegopt, "this is not a SQLite file; choose another file"};
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {StoreErrorCode::kBusy, "another program holds a lock on the file; close it"};
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      return {StoreErrorCode::kUnwritable,
              files::WriteAdvice("check the path, that its folder exists, and the permissions")};
    case SQLITE_TOOBIG:
      return {StoreErrorCode::kBadQuery, "a value may have at most " + std::to_string(kMaxMiBOfQueriedValue) +
                                             " MiB in a query; read a part of it, for "
                                             "example with substr()"};
    case SQLITE_AUTH:
      return {StoreErrorCode::kBadQuery, "the database is read-only here: only SELECT is allowed"};
    case SQLITE_INTERRUPT:
      return {StoreErrorCode::kInterrupted, "ask for less or allow more time"};
    case SQLITE_CONSTRAINT:
    case SQLITE_MISMATCH:
      return {StoreErrorCode::kConstraint, "this is a defect of legopt; please report it"};
    default:
      return {StoreErrorCode::kBadQuery, "check the SQL"};
  }
}

constexpr int kCommonFlags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_PRIVATECACHE | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_URI;

int FlagsOf(Connection::Mode mode) {
  if (mode == Connection::Mode::kReadWriteCreate || mode == Connection::Mode::kMemory) {
    return kCommonFlags | SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  }
  return kCommonFlags | SQLITE_OPEN_READONLY;
}

// Builds a file URI with every character of the path escaped. The authority is empty; after "file:" alone, a path that
// begins with two slashes would name a host.
std::string UriOf(const std::filesystem::path& path, Connection::Mode mode) {
  if (mode == Connection::Mode::kMemory) return ":memory:";
  constexpr char kHex[] = "0123456789ABCDEF";
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '-' || c == '_') {
      uri += c;
    } else {
      uri += {'%', kHex[byte >> 4U], kHex[byte & 0xfU]};
    }
  }
  return mode == Connection::Mode::kImmutable ? uri + "?immutable=1" : uri;
}

// SQLite builds the names of the side files in buffers of 512 bytes, so longer paths are refused.
void RequireShortPath(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = 500;
  const std::size_t bytes = std::filesystem::absolute(path).string().size();
  if (bytes <= kMostBytes) return;
  throw StoreError(StoreErrorCode::kUnwritable, path.string() + ": the path has " + std::to_string(bytes) +
                                                    " bytes, more than the " + std::to_string(kMostBytes) +
                                                    " that SQLite can open; use a folder with a shorter path");
}

// Returns the file that a connection has opened, with all links followed; side files are beside it.
std::string FileOf(sqlite3* handle) {
  const char* file = sqlite3_db_filename(handle, "main");
  return file == nullptr ? "" : file;
}

bool HasLog(const std::string& file) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(file + "-wal", error));
}

bool HasEmptyLog(const std::string& file) {
  std::error_code error;
  return std::filesystem::file_size(file + "-wal", error) == 0 && !error;
}

// Lets SQLite remove the side files that a reader has created: a read-only connection never removes them, while a
// writing one does when it closes, but only if it is the last connection of all processes. Failures are ignored: empty
// side files do no harm.
void RemoveSideFiles(const std::string& uri) {
  constexpr int kPatience_ms = 50;
  sqlite3* handle = nullptr;
  if (sqlite3_open_v2(uri.c_str(), &handle, kCommonFlags | SQLITE_OPEN_READWRITE, nullptr) == SQLITE_OK) {
    sqlite3_busy_timeout(handle, kPatience_ms);
    sqlite3_exec(handle, "SELECT count(*) FROM sqlite_schema", nullptr, nullptr, nullptr);  // opens the side files
  }
  sqlite3_close(handle);
}

// Switches off SQLite's unused memory statistics. They take a process-wide lock at every allocation, an eighth of the
// cost of a commit. This has an effect only before the first connection.
void StopMemoryStatistics() { [[maybe_unused]] static const int once = sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0); }

}  // namespace

// --- Statement -------------------------------------------------------------------------------------------------------

Statement::Statement(Connection& connection, std::string_view sql, bool persistent) : handle_(connection.handle()) {
  const unsigned flags = persistent ? SQLITE_PREPARE_PERSISTENT : 0;
  Check(sqlite3_prepare_v3(handle_, sql.data(), static_cast<int>(sql.size()), flags, &statement_, nullptr), SQLITE_OK);
  if (statement_ == nullptr) throw StoreError(StoreErrorCode::kBadQuery, "empty SQL statement");
}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement::Statement(Statement&& other) noexcept
    : handle_(other.handle_), statement_(std::exchange(other.statement_, nullptr)) {}

Statement& Statement::operator=(Statement&& other) noexcept {
  std::swap(handle_, other.handle_);
  std::swap(statement_, other.statement_);
  return *this;
}

void Statement::Check(int code, int expected) {
  if (code != expected) Connection::Throw(handle_, code, "run SQL");
}

Statement& Statement::Bind(int parameter, std::int64_t value) {
  Check(sqlite3_bind_int64(statement_, parameter, value), SQLITE_OK);
  return *this;
}

Statement& Statement::Bind(int parameter, double value) {
  if (!std::isfinite(value)) return BindNull(parameter);
  Check(sqlite3_bind_double(statement_, parameter, value), SQLITE_OK);
  return *this;
}

Statement& Statement::Bind(int parameter, std::string_view text) {
  // An empty view may have a null pointer, which SQLite would bind as NULL.
  const char* data = text.empty() ? "" : text.data();
  Check(sqlite3_bind_text64(statement_, parameter, data, text.size(), SQLITE_TRANSIENT, SQLITE_UTF8), SQLITE_OK);
  return *this;
}

Statement& Statement::Bind(int parameter, std::optional<std::int64_t> value) {
  return value ? Bind(parameter, *value) : BindNull(parameter);
}

Statement& Statement::BindNull(int parameter) {
  Check(sqlite3_bind_null(statement_, parameter), SQLITE_OK);
  return *this;
}

Statement& Statement::BindBlob(int parameter, const void* data, std::size_t size) {
  const void* bytes = size == 0 ? "" : data;
  Check(sqlite3_bind_blob64(statement_, parameter, bytes, size, SQLITE_TRANSIENT), SQLITE_OK);
  return *this;
}

bool Statement::Step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  // Reset makes the statement usable again but clears the message, so read the message first.
  const std::string message = sqlite3_errmsg(handle_);
  Reset();
  const Meaning meaning = MeaningOf(handle_, code);
  const char* file = sqlite3_db_filename(handle_, "main");
  throw StoreError(meaning.code, std::string(file == nullptr ? "" : file) + ": " + message + "; " + meaning.advice);
}

void Statement::Reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

void Statement::RunBound() {
  while (Step()) {
  }
  Reset();
}

int Statement::num_columns() const { return sqlite3_column_count(statement_); }

std::string Statement::column_name(int column) const {
  const char* name = sqlite3_column_name(statement_, column);
  return name == nullptr ? "" : name;
}

Statement::Type Statement::column_type(int column) const {
  switch (sqlite3_column_type(statement_, column)) {
    case SQLITE_INTEGER:
      return Type::kInteger;
    case SQLITE_FLOAT:
      return Type::kReal;
    case SQLITE_TEXT:
      return Type::kText;
    case SQLITE_BLOB:
      return Type::kBlob;
    default:
      return Type::kNull;
  }
}

std::int64_t Statement::column_int(int column) const { return sqlite3_column_int64(statement_, column); }
double Statement::column_double(int column) const { return sqlite3_column_double(statement_, column); }

std::string Statement::column_text(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return data == nullptr ? std::string() : std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

void Statement::ThrowUnknownEnumName(const std::string& text) const {
  constexpr std::size_t kMostBytes = 40;
  std::string shown;
  for (const char c : text.substr(0, kMostBytes)) shown += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  const char* file = sqlite3_db_filename(handle_, "main");
  throw StoreError(StoreErrorCode::kCorrupt, std::string(file == nullptr ? "" : file) + ": holds the unknown word '" +
                                                 shown + (text.size() > kMostBytes ? "..." : "") +
                                                 "'; restore a backup: 'legopt service restore BACKUP --db FILE'");
}

bool Statement::read_only() const { return sqlite3_stmt_readonly(statement_) != 0; }

// --- Connection ------------------------------------------------------------------------------------------------------

Connection::Connection(const std::filesystem::path& path, Mode mode, std::filesystem::path shown)
    : path_(std::move(shown)) {
  StopMemoryStatistics();
  if (mode != Mode::kMemory) RequireShortPath(path);
  const int code = sqlite3_open_v2(UriOf(path, mode).c_str(), &handle_, FlagsOf(mode), nullptr);
  try {
    if (code != SQLITE_OK) {
      const Meaning meaning = MeaningOf(handle_, code);
      throw StoreError(meaning.code,
                       path.string() + ": cannot open the database: " + sqlite3_errstr(code) + "; " + meaning.advice);
    }
    if (mode == Mode::kReadOnly && !HasLog(FileOf(handle_))) file_without_log_ = FileOf(handle_);
    Configure();
  } catch (...) {
    sqlite3_close(handle_);
    throw;
  }
}

Connection::~Connection() {
  sqlite3_close(handle_);
  if (file_without_log_.empty() || !HasEmptyLog(file_without_log_)) return;
  RemoveSideFiles(UriOf(file_without_log_, Mode::kReadWriteCreate));
}

void Connection::Configure() {
  SetBusyTimeout(kBusyTimeout);
  const auto set = [this](int option, int value) {
    if (const int code = sqlite3_db_config(handle_, option, value, nullptr); code != SQLITE_OK) {
      Throw(handle_, code, "configure the connection");
    }
  };
  set(SQLITE_DBCONFIG_ENABLE_FKEY, 1);
  set(SQLITE_DBCONFIG_DEFENSIVE, 1);
  set(SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0);
  set(SQLITE_DBCONFIG_DQS_DML, 0);
  set(SQLITE_DBCONFIG_DQS_DDL, 0);
  set(SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0);
  Execute("PRAGMA mmap_size = 0");
}

void Connection::Execute(const std::string& sql) {
  if (const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr); code != SQLITE_OK) {
    Throw(handle_, code, "run SQL");
  }
}

void Connection::ExecuteUndefended(const std::string& sql) {
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  if (code != SQLITE_OK) Throw(handle_, code, "run SQL");
}

std::int64_t Connection::QueryInt(const std::string& sql) {
  Statement statement(*this, sql, false);
  return statement.Step() ? statement.column_int(0) : 0;
}

std::string Connection::QueryText(const std::string& sql) {
  Statement statement(*this, sql, false);
  return statement.Step() ? statement.column_text(0) : std::string();
}

void Connection::CopyFrom(Connection& source) {
  sqlite3_backup* backup = sqlite3_backup_init(handle_, "main", source.handle_, "main");
  if (backup == nullptr) Throw(handle_, sqlite3_errcode(handle_), "begin the copy");
  constexpr int kAllPages = -1;
  const int step = sqlite3_backup_step(backup, kAllPages);
  const int finish = sqlite3_backup_finish(backup);
  if (step != SQLITE_DONE) Throw(handle_, step == SQLITE_OK ? finish : step, "copy the database");
}

std::int64_t Connection::changes() const { return sqlite3_changes64(handle_); }
bool Connection::read_only() const { return sqlite3_db_readonly(handle_, "main") == 1; }
void Connection::SetBusyTimeout(std::chrono::milliseconds timeout) {
  sqlite3_busy_timeout(handle_, static_cast<int>(timeout.count()));
}
void Connection::Interrupt() { sqlite3_interrupt(handle_); }

void Connection::Throw(sqlite3* handle, int code, const std::string& doing) {
  const Meaning meaning = MeaningOf(handle, code);
  const char* file = handle == nullptr ? nullptr : sqlite3_db_filename(handle, "main");
  throw StoreError(meaning.code, std::string(file == nullptr ? "" : file) + ": cannot " + doing + ": " +
                                     (handle == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(handle)) + "; " +
                                     meaning.advice);
}

// --- Transaction -----------------------------------------------------------------------------------------------------

Transaction::Transaction(Connection& connection) : connection_(connection) { connection_.Execute("BEGIN IMMEDIATE"); }

Transaction::~Transaction() {
  // Some errors (FULL, IOERR, NOMEM) have already rolled the transaction back.
  if (open_ && sqlite3_get_autocommit(connection_.handle()) == 0) {
    sqlite3_exec(connection_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

void Transaction::Commit() {
  connection_.Execute("COMMIT");
  open_ = false;
}

}  // namespace legopt::db
