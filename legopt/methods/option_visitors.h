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

  void Add(const std::string& field, const std::string& value, const std::string& message, const std::string& fix);
  bool Has(const std::string& field) const;
  const std::string& source() const { return source_; }
  const std::vector<InputError::Fault>& all() const { return all_; }

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

  OptionReader(const nlohmann::json& object, std::string where, OptionFaults& faults);

  void Number(const char* key, double& value, double low, double high) override;
  void Integer(const char* key, int& value, int low, int high) override;
  void Boolean(const char* key, bool& value) override;
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}
  /// False when there is none.
  bool Text(const char* key, std::string& value);
  /// The value of `key`, or null.
  const nlohmann::json* Find(const char* key);

  /// After all keys are read: a fault for each that nobody asked for.
  void RefuseOthers() const;

 protected:
  void Word(const char* key, std::size_t& index, std::span<const std::string_view> words) override;

 private:
  void Fail(const std::string& key, const std::string& value, const std::string& message, const std::string& fix) const;

  const nlohmann::json& object_;
  std::string where_;
  OptionFaults& faults_;
  std::vector<std::string> keys_;
};

/// Finds values out of range and conditions that do not hold.
class OptionChecker : public ConstOptionFields {
 public:
  OptionChecker(std::string where, OptionFaults& faults) : where_(std::move(where)), faults_(faults) {}

  void Number(const char* key, const double& value, double low, double high) override;
  void Integer(const char* key, const int& value, int low, int high) override;
  void Boolean(const char*, const bool&) override {}
  void Require(bool condition, const char* key, const char* other, const std::string& value, const std::string& message,
               const std::string& fix) override;

 protected:
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override;

 private:
  std::string where_;
  OptionFaults& faults_;
};

/// Writes every field, all of them faultless, into a JSON object.
class OptionWriter : public ConstOptionFields {
 public:
  explicit OptionWriter(nlohmann::json& object) : object_(object) {}

  void Number(const char* key, const double& value, double, double) override { object_[key] = value; }
  void Integer(const char* key, const int& value, int, int) override { object_[key] = value; }
  void Boolean(const char* key, const bool& value) override { object_[key] = value; }
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}

 protected:
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override {
    object_[key] = words[index];
  }

 private:
  nlohmann::json& object_;
};

}  // namespace legopt
