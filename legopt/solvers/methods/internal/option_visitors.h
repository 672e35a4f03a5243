#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "legopt/solvers/internal/option_fields.h"
#include "legopt/types/input_error.h"

namespace legopt {

/// Diagnostics of one description, in order of occurrence.
class OptionDiagnostics {
 public:
  /// `source` is the file name in messages.
  explicit OptionDiagnostics(std::string source) : source_(std::move(source)) {}

  /// Adds a diagnostic for `field` with its `value`, a `message` and a `fix` (may be empty).
  void Add(const std::string& field, const std::string& value, const std::string& message, const std::string& fix);
  bool Has(const std::string& field) const;                           ///< whether `field` already has a diagnostic
  const std::string& source() const { return source_; }               ///< file name in messages
  const std::vector<InputError::Fault>& all() const { return all_; }  ///< diagnostics in order of occurrence

  /// Throws an InputError with all diagnostics, if there are any.
  void ThrowIfAny() const;

 private:
  std::string source_;
  std::vector<InputError::Fault> all_;
};

/// Reads the keys of one JSON object into variables with ranges, and remembers them in order to reject all other keys.
/// If a key is missing or invalid, its variable does not change. OptionChecker checks conditions between fields. Field
/// names in diagnostics begin with `where`, if given. Object and diagnostics must outlive the reader.
class OptionReader : public OptionFields {
 public:
  /// Returns whether a value is an object, and adds a diagnostic if not.
  static bool IsMap(const nlohmann::json& value, const std::string& field, OptionDiagnostics& faults);

  /// Reads from `object`, which must be a JSON object (IsMap).
  OptionReader(const nlohmann::json& object, std::string where, OptionDiagnostics& faults);

  /// Reads a number. Adds a diagnostic if it is not a number, not finite or out of range.
  void Number(const char* key, double& value, double low, double high) override;
  /// Reads an integer. Adds a diagnostic if it is not an integer or out of range.
  void Integer(const char* key, int& value, int low, int high) override;
  /// Reads true or false. Adds a diagnostic for anything else, including 0 and 1.
  void Boolean(const char* key, bool& value) override;
  /// Reads a digest. Adds a diagnostic if the value is not a digest.
  void Digest(const char* key, std::string& value) override;
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}
  /// Adds a diagnostic if the removed key is present.
  void RemovedKey(const char* key, const char* fix) override;
  /// Reads a non-empty text. Returns false if the key is missing or invalid.
  bool Text(const char* key, std::string& value);
  /// Returns the value of `key`, or null.
  const nlohmann::json* Find(const char* key);

  /// Adds a diagnostic for each key that has not been read. Must be called after all keys have been read.
  void RejectUnknownKeys() const;

 protected:
  /// Reads a name of an enumeration. Adds a diagnostic with the nearest name if it is unknown.
  void Word(const char* key, std::size_t& index, std::span<const std::string_view> words) override;

 private:
  void Fail(const std::string& key, const std::string& value, const std::string& message, const std::string& fix) const;

  const nlohmann::json& object_;
  std::string where_;
  OptionDiagnostics& faults_;
  std::vector<std::string> keys_, former_keys_;
};

/// Reports values out of range and violated conditions.
class OptionChecker : public ConstOptionFields {
 public:
  /// Field names in diagnostics begin with `where`, if given. `faults` must outlive the checker.
  OptionChecker(std::string where, OptionDiagnostics& faults) : where_(std::move(where)), faults_(faults) {}

  /// Adds a diagnostic if the value is out of range or NaN.
  void Number(const char* key, const double& value, double low, double high) override;
  /// Adds a diagnostic if the value is out of range.
  void Integer(const char* key, const int& value, int low, int high) override;
  void Boolean(const char*, const bool&) override {}  ///< both values are valid
  /// Adds a diagnostic if the value is not a digest.
  void Digest(const char* key, const std::string& value) override;
  void Require(bool condition, const char* key, const char* other, const std::string& value, const std::string& message,
               const std::string& fix) override;

 protected:
  /// Adds a diagnostic if the index is not a value of the enumeration.
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override;

 private:
  std::string where_;
  OptionDiagnostics& faults_;
};

/// Writes every field into a JSON object. All values must be valid.
class OptionWriter : public ConstOptionFields {
 public:
  /// Writes into `object`, which must outlive the writer; replaces existing keys.
  explicit OptionWriter(nlohmann::json& object) : object_(object) {}

  /// Writes the number; JSON uses the shortest text that reads back to the same bits.
  void Number(const char* key, const double& value, double, double) override { object_[key] = value; }
  /// Writes the integer.
  void Integer(const char* key, const int& value, int, int) override { object_[key] = value; }
  /// Writes true or false.
  void Boolean(const char* key, const bool& value) override { object_[key] = value; }
  /// Writes the digest.
  void Digest(const char* key, const std::string& value) override { object_[key] = value; }
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}

 protected:
  bool omits_defaults() const override { return true; }
  /// Writes the name.
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override {
    object_[key] = words[index];
  }

 private:
  nlohmann::json& object_;
};

}  // namespace legopt
