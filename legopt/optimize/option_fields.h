#pragma once

#include <string>
#include <vector>

namespace legopt {

/// Visitor of a set of options: each struct of options lists its fields once, for reading, writing and documenting.
class OptionFields {
 public:
  virtual ~OptionFields() = default;

  /// Values from `low` to `high`, both included.
  virtual void Number(const char* key, double& value, double low, double high) = 0;
  virtual void Integer(const char* key, int& value, int low, int high) = 0;
  virtual void Boolean(const char* key, bool& value) = 0;
  virtual void Choice(const char* key, std::string& value, const std::vector<std::string>& choices) = 0;
  /// A condition between fields that have been visited. `key` is the one to blame.
  virtual void Require(bool condition, const char* key, const std::string& value, const std::string& message,
                       const std::string& fix) = 0;
};

}  // namespace legopt
