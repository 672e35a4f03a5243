#include "legopt/methods/option_reader.h"

#include <climits>
#include <cmath>
#include <utility>

#include "legopt/input_error.h"
#include "legopt/nearest_name.h"

namespace legopt {
namespace {

using nlohmann::json;

std::string Range(const json& low, const json& high) { return " from " + low.dump() + " to " + high.dump(); }

// Text without its quotes: the error has some.
std::string Shown(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

}  // namespace

OptionReader::OptionReader(const json& object, std::string source, std::string where)
    : object_(object), source_(std::move(source)), where_(std::move(where)) {
  if (!object.is_object()) {
    throw InputError({source_, where_, object.dump(), "must be a map of keys and values", "write 'key: value' pairs"});
  }
}

void OptionReader::Number(const char* key, double& value, double low, double high) {
  const json* found = Find(key);
  if (found == nullptr) return;
  const double read = found->is_number() ? found->get<double>() : std::nan("");
  if (!(read >= low && read <= high)) Fail(key, Shown(*found), "must be a number" + Range(low, high), "");
  value = read;
}

void OptionReader::Integer(const char* key, int& value, int low, int high) {
  const json* found = Find(key);
  if (found == nullptr) return;
  const bool fits =
      found->is_number_unsigned() ? found->get<unsigned long long>() <= LLONG_MAX : found->is_number_integer();
  const long long read = fits ? found->get<long long>() : 0;
  if (!fits || read < low || read > high) Fail(key, Shown(*found), "must be a whole number" + Range(low, high), "");
  value = static_cast<int>(read);
}

void OptionReader::Boolean(const char* key, bool& value) {
  const json* found = Find(key);
  if (found == nullptr) return;
  if (!found->is_boolean()) Fail(key, Shown(*found), "must be true or false", "");
  value = found->get<bool>();
}

void OptionReader::Text(const char* key, std::string& value) {
  const json* found = Find(key);
  if (found == nullptr) return;
  if (!found->is_string() || found->get<std::string>().empty()) {
    Fail(key, found->dump(), "must be a text", "write a name");
  }
  value = found->get<std::string>();
}

void OptionReader::Choice(const char* key, std::string& value, const std::vector<std::string>& choices) {
  Text(key, value);
  for (const std::string& choice : choices) {
    if (choice == value) return;
  }
  Fail(key, value, "is not known", SuggestName(value, choices));
}

void OptionReader::Require(bool condition, const char* key, const std::string& value, const std::string& message,
                           const std::string& fix) {
  if (!condition) Fail(key, value, message, fix);
}

const json* OptionReader::Find(const char* key) {
  keys_.emplace_back(key);
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

void OptionReader::RefuseOthers() const {
  for (const auto& [key, value] : object_.items()) {
    bool known = false;
    for (const std::string& name : keys_) known = known || name == key;
    if (!known) Fail(key.c_str(), "", "unknown key", SuggestName(key, keys_));
  }
}

void OptionReader::Fail(const char* key, const std::string& value, const std::string& message,
                        const std::string& fix) const {
  throw InputError({source_, where_.empty() ? key : where_ + "." + key, value, message, fix});
}

}  // namespace legopt
