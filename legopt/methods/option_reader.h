#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "legopt/optimize/option_fields.h"

namespace legopt {

/// Reads the keys of one JSON object into variables with ranges; knows its keys, so that it can refuse others.
/// Every fault is an InputError that names `source`, the field (after `where`, if given), the value and the fix.
/// The object must outlive the reader.
class OptionReader : public OptionFields {
 public:
  OptionReader(const nlohmann::json& object, std::string source, std::string where);

  void Number(const char* key, double& value, double low, double high) override;
  void Integer(const char* key, int& value, int low, int high) override;
  void Boolean(const char* key, bool& value) override;
  void Choice(const char* key, std::string& value, const std::vector<std::string>& choices) override;
  void Require(bool condition, const char* key, const std::string& value, const std::string& message,
               const std::string& fix) override;
  void Text(const char* key, std::string& value);
  /// The value of `key`, or null.
  const nlohmann::json* Find(const char* key);

  /// After all keys are read: throws for the first one that nobody asked for.
  void RefuseOthers() const;

  [[noreturn]] void Fail(const char* key, const std::string& value, const std::string& message,
                         const std::string& fix) const;

 private:
  const nlohmann::json& object_;
  std::string source_;
  std::string where_;
  std::vector<std::string> keys_;
};

/// Writes every field into a JSON object.
class OptionWriter : public OptionFields {
 public:
  explicit OptionWriter(nlohmann::json& object) : object_(object) {}

  void Number(const char* key, double& value, double, double) override { object_[key] = value; }
  void Integer(const char* key, int& value, int, int) override { object_[key] = value; }
  void Boolean(const char* key, bool& value) override { object_[key] = value; }
  void Choice(const char* key, std::string& value, const std::vector<std::string>&) override { object_[key] = value; }
  void Require(bool, const char*, const std::string&, const std::string&, const std::string&) override {}

 private:
  nlohmann::json& object_;
};

}  // namespace legopt
