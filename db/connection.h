#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/store_error.h"
#include "legopt/types/enum_names.h"

struct sqlite3;
struct sqlite3_stmt;

namespace legopt::db {

/// Largest value that ReadOnlyDatabase reads.
inline constexpr int kMaxMiBOfQueriedValue = 64;

class Connection;

/// A prepared statement. Bind in any order, then Step until it returns false; Reset before the next use.
/// Every failure is a StoreError. Must not outlive its connection. Thread rule: that of the connection.
class Statement {
 public:
  Statement() = default;
  Statement(Connection& connection, std::string_view sql, bool persistent = true);
  ~Statement();
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&& other) noexcept;

  /// Parameters are numbered from 1. Text and blobs are copied. A non-finite double is bound as NULL.
  Statement& Bind(int parameter, std::int64_t value);
  Statement& Bind(int parameter, int value) { return Bind(parameter, static_cast<std::int64_t>(value)); }
  Statement& Bind(int parameter, double value);
  Statement& Bind(int parameter, std::string_view text);
  Statement& Bind(int parameter, const char* text) { return Bind(parameter, std::string_view(text)); }
  Statement& Bind(int parameter, const std::string& text) { return Bind(parameter, std::string_view(text)); }
  Statement& Bind(int parameter, std::optional<std::int64_t> value);
  /// Binds the name of an enumerator; nullopt binds NULL.
  template <NamedEnum Enum>
  Statement& Bind(int parameter, std::optional<Enum> value) {
    return value ? Bind(parameter, ToString(*value)) : BindNull(parameter);
  }
  Statement& Bind(int parameter, const std::vector<std::uint8_t>& bytes) {
    return BindBlob(parameter, bytes.data(), bytes.size());
  }
  template <NamedEnum Enum>
  Statement& Bind(int parameter, Enum value) {
    return Bind(parameter, ToString(value));
  }
  Statement& BindNull(int parameter);
  Statement& BindBlob(int parameter, const void* data, std::size_t size);

  template <class... Values>
  Statement& BindAll(const Values&... values) {
    int parameter = 0;
    (Bind(++parameter, values), ...);
    return *this;
  }

  /// Returns true if a row is available, false at the end.
  bool Step();
  void Reset();
  /// Binds all values, runs the statement to its end and resets it.
  template <class... Values>
  void Run(const Values&... values) {
    BindAll(values...);
    RunBound();
  }
  void RunBound();

  enum class Type { kNull, kInteger, kReal, kText, kBlob };
  int num_columns() const;
  std::string column_name(int column) const;
  Type column_type(int column) const;  ///< column numbers start at 0
  std::int64_t column_int(int column) const;
  double column_double(int column) const;
  std::string column_text(int column) const;  ///< valid for text and blobs
  /// Returns the enumerator with the column's name. Throws StoreError (kCorrupt) if there is none.
  template <NamedEnum Enum>
  Enum column_enum(int column) const {
    const std::string text = column_text(column);
    if (const std::optional<Enum> value = ParseEnum<Enum>(text)) return *value;
    ThrowUnknownEnumName(text);
  }
  bool read_only() const;

 private:
  friend class Connection;
  [[noreturn]] void ThrowUnknownEnumName(const std::string& text) const;
  void Check(int code, int expected);
  sqlite3* handle_ = nullptr;
  sqlite3_stmt* statement_ = nullptr;
};

/// A SQLite connection with the settings that all legopt connections share: foreign keys enforced, defensive mode,
/// untrusted schema, double-quoted strings off, extension loading off, no mmap, a busy timeout.
/// Thread rule: one thread at a time, except Interrupt. Never used across fork().
class Connection {
 public:
  enum class Mode {
    kReadWriteCreate,
    kReadOnly,   ///< leaves no side files beside a file that had no log before and no other connection
    kImmutable,  ///< read-only, for a file without writers in a folder without write permission: no side files are used
    kMemory,     ///< a private in-memory database; the path is only a label
  };

  /// Throws StoreError (kUnwritable if the file cannot be opened in this mode).
  Connection(const std::filesystem::path& path, Mode mode) : Connection(path, mode, path) {}
  /// Opens a copy: path() returns `shown`, the path of the original.
  Connection(const std::filesystem::path& path, Mode mode, std::filesystem::path shown);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  const std::filesystem::path& path() const { return path_; }
  sqlite3* handle() { return handle_; }

  /// Runs one or more statements, ignoring rows.
  void Execute(const std::string& sql);
  /// Runs trusted SQL that may rewrite the schema text, which defensive mode forbids.
  void ExecuteUndefended(const std::string& sql);
  /// Returns the first column of the first row, or 0 without a row.
  std::int64_t QueryInt(const std::string& sql);
  std::string QueryText(const std::string& sql);
  /// Replaces the contents of this database by the committed contents of `source`, read in one transaction. Copying in
  /// several steps would restart with every commit of the server.
  void CopyFrom(Connection& source);
  std::int64_t changes() const;
  bool read_only() const;
  static constexpr std::chrono::milliseconds kBusyTimeout{5'000};
  /// Sets how long to wait for the lock of another connection (default: kBusyTimeout).
  void SetBusyTimeout(std::chrono::milliseconds timeout);
  void Interrupt();

  /// Throws the StoreError for a SQLite result code; `doing` completes the message "FILE: cannot ...".
  [[noreturn]] static void Throw(sqlite3* handle, int code, const std::string& doing);

 private:
  void Configure();
  std::filesystem::path path_;
  std::string file_without_log_;  // a file opened read-only that had no log before; its side files are removed
  sqlite3* handle_ = nullptr;
};

/// BEGIN IMMEDIATE ... COMMIT; rolled back by the destructor unless committed.
class Transaction {
 public:
  explicit Transaction(Connection& connection);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void Commit();

 private:
  Connection& connection_;
  bool open_ = true;
};

}  // namespace legopt::db
