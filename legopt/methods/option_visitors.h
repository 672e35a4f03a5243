#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "legopt/input_error.h"
#include "legopt/optimize/option_fields.h"

namespace legopt {

/// The faults of one description, in the order in which they are met.
class OptionFaults {
 public:
  /// `source` names the file in errors.
  explicit OptionFaults(std::string source) : source_(std::move(source)) {}

  /// One more fault: of `field`, whose `value` is shown, with what is wrong and what mends it (may be empty).
  void Add(const std::string& field, const std::string& value, const std::string& message, const std::string& fix);
  bool Has(const std::string& field) const;                           ///< whether `field` has a fault already
  const std::string& source() const { return source_; }               ///< the file in errors
  const std::vector<InputError::Fault>& all() const { return all_; }  ///< in the order in which they were met

  /// Throws an InputError of all faults, if there are any.
  void ThrowIfAny() const;

 private:
  std::string source_;
  std::vector<InputError::Fault> all_;
};

/// Reads the keys of one JSON object into variables with ranges; knows its keys, so that it can refuse others. Where a
/// key is missing or faulty, the variable stays as it is. Conditions between fields are left to OptionChecker. Fields
/// are named after `where`, if given. Object and faults must outlive the reader.
class OptionReader : public OptionFields {
 public:
  /// False, with a fault, when the value of a key is no object.
  static bool IsMap(const nlohmann::json& value, const std::string& field, OptionFaults& faults);

  /// Reads from `object`, which must be one (IsMap).
  OptionReader(const nlohmann::json& object, std::string where, OptionFaults& faults);

  /// Reads a number; a fault when it is none, not finite or out of range.
  void Number(const char* key, double& value, double low, double high) override;
  /// Reads a whole number; a fault when it is none or out of range.
  void Integer(const char* key, int& value, int low, int high) override;
  /// Reads true or false; a fault for anything else, 0 and 1 included.
  void Boolean(const char* key, bool& value) override;
  /// Reads a hash; a fault for what cannot be one.
  void Digest(const char* key, std::string& value) override;
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}
  /// A fault when there is such a key.
  void Former(const char* key, const char* fix) override;
  /// False when there is none.
  bool Text(const char* key, std::string& value);
  /// The value of `key`, or null.
  const nlohmann::json* Find(const char* key);

  /// After all keys are read: a fault for each that nobody asked for.
  void RefuseOthers() const;

 protected:
  /// Reads a word; a fault that names the nearest when there is no such word.
  void Word(const char* key, std::size_t& index, std::span<const std::string_view> words) override;

 private:
  void Fail(const std::string& key, const std::string& value, const std::string& message, const std::string& fix) const;

  const nlohmann::json& object_;
  std::string where_;
  OptionFaults& faults_;
  std::vector<std::string> keys_, former_keys_;
};

/// Finds values out of range and conditions that do not hold.
class OptionChecker : public ConstOptionFields {
 public:
  /// Fields are named after `where`, if given. `faults` must outlive the checker.
  OptionChecker(std::string where, OptionFaults& faults) : where_(std::move(where)), faults_(faults) {}

  /// A fault for a value that is out of range or no number.
  void Number(const char* key, const double& value, double low, double high) override;
  /// A fault for a value that is out of range.
  void Integer(const char* key, const int& value, int low, int high) override;
  void Boolean(const char*, const bool&) override {}  ///< either value is legal
  /// A fault for what cannot be a hash.
  void Digest(const char* key, const std::string& value) override;
  void Require(bool condition, const char* key, const char* other, const std::string& value, const std::string& message,
               const std::string& fix) override;

 protected:
  /// A fault for what is no value of the enumeration.
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override;

 private:
  std::string where_;
  OptionFaults& faults_;
};

/// Writes every field, all of them faultless, into a JSON object.
class OptionWriter : public ConstOptionFields {
 public:
  /// Writes into `object`, which must outlive the writer; keys that it has are replaced.
  explicit OptionWriter(nlohmann::json& object) : object_(object) {}

  /// Writes the number; JSON keeps its bits by the shortest text that reads back.
  void Number(const char* key, const double& value, double, double) override { object_[key] = value; }
  /// Writes the whole number.
  void Integer(const char* key, const int& value, int, int) override { object_[key] = value; }
  /// Writes true or false.
  void Boolean(const char* key, const bool& value) override { object_[key] = value; }
  /// Writes the digits.
  void Digest(const char* key, const std::string& value) override { object_[key] = value; }
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}

 protected:
  bool leaves_usual_out() const override { return true; }
  /// Writes the word.
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override {
    object_[key] = words[index];
  }

 private:
  nlohmann::json& object_;
};

}  // namespace legopt
