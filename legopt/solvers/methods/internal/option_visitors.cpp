#include "legopt/solvers/methods/internal/option_visitors.h"

#include <algorithm>
#include <climits>
#include <cmath>

#include "legopt/input/json.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/nearest_name.h"

namespace legopt {
namespace {

using nlohmann::json;

constexpr char kDigestRule[] = "must be a hash of 64 lower-case hexadecimal digits";

std::string NumberRange(double low, double high) {
  return "must be a number from " + Dump(json(low)) + " to " + Dump(json(high));
}

std::string IntegerRange(int low, int high) {
  return "must be a whole number from " + Dump(json(low)) + " to " + Dump(json(high));
}

// Text is shown without quotes, because the error message adds them.
std::string Shown(const json& value) { return value.is_string() ? value.get<std::string>() : Dump(value); }

std::string Shown(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  return Dump(json(value));
}

std::string Path(const std::string& where, const std::string& key) { return where.empty() ? key : where + "." + key; }

std::string Suggestion(const std::string& word, std::span<const std::string_view> words) {
  return SuggestName(word, std::vector<std::string>(words.begin(), words.end()));
}

}  // namespace

void OptionDiagnostics::Add(const std::string& field, const std::string& value, const std::string& message,
                            const std::string& fix) {
  all_.push_back({source_, field, value, message, fix});
}

bool OptionDiagnostics::Has(const std::string& field) const {
  return std::ranges::any_of(all_, [&](const InputError::Fault& fault) { return fault.field == field; });
}

void OptionDiagnostics::ThrowIfAny() const {
  if (!all_.empty()) throw InputError::Of(all_);
}

bool OptionReader::IsMap(const json& value, const std::string& field, OptionDiagnostics& faults) {
  if (!value.is_object()) {
    faults.Add(field, Dump(value), "must be a map of keys and values", "write 'key: value' pairs");
  }
  return value.is_object();
}

OptionReader::OptionReader(const json& object, std::string where, OptionDiagnostics& faults)
    : object_(object), where_(std::move(where)), faults_(faults) {}

void OptionReader::Number(const char* key, double& value, double low, double high) {
  const json* found = Find(key);
  if (found == nullptr) return;
  const double read = found->is_number() ? found->get<double>() : std::nan("");
  if (!(read >= low && read <= high)) return Fail(key, Shown(*found), NumberRange(low, high), "");
  value = read;
}

void OptionReader::Integer(const char* key, int& value, int low, int high) {
  const json* found = Find(key);
  if (found == nullptr) return;
  const bool fits =
      found->is_number_unsigned() ? found->get<unsigned long long>() <= LLONG_MAX : found->is_number_integer();
  const long long read = fits ? found->get<long long>() : 0;
  if (!fits || read < low || read > high) return Fail(key, Shown(*found), IntegerRange(low, high), "");
  value = static_cast<int>(read);
}

void OptionReader::Boolean(const char* key, bool& value) {
  const json* found = Find(key);
  if (found == nullptr) return;
  if (!found->is_boolean()) return Fail(key, Shown(*found), "must be true or false", "");
  value = found->get<bool>();
}

void OptionReader::Digest(const char* key, std::string& value) {
  const json* found = Find(key);
  if (found == nullptr) return;
  if (!found->is_string() || !IsBlake2bHex(found->get<std::string>())) return Fail(key, Shown(*found), kDigestRule, "");
  value = found->get<std::string>();
}

bool OptionReader::Text(const char* key, std::string& value) {
  const json* found = Find(key);
  if (found == nullptr) return false;
  if (!found->is_string() || found->get<std::string>().empty()) {
    Fail(key, Dump(*found), "must be a text", "write a name");
    return false;
  }
  value = found->get<std::string>();
  return true;
}

void OptionReader::Word(const char* key, std::size_t& index, std::span<const std::string_view> words) {
  std::string word;
  if (!Text(key, word)) return;
  const auto found = std::ranges::find(words, word);
  if (found == words.end()) return Fail(key, word, "is not known", Suggestion(word, words));
  index = static_cast<std::size_t>(found - words.begin());
}

const json* OptionReader::Find(const char* key) {
  keys_.emplace_back(key);
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

void OptionReader::RemovedKey(const char* key, const char* fix) {
  former_keys_.emplace_back(key);
  const auto found = object_.find(key);
  if (found != object_.end()) Fail(key, Shown(*found), "is no option any more", fix);
}

void OptionReader::RejectUnknownKeys() const {
  for (const auto& [key, value] : object_.items()) {
    const bool known =
        std::ranges::find(keys_, key) != keys_.end() || std::ranges::find(former_keys_, key) != former_keys_.end();
    if (!known) Fail(key, "", "unknown key", SuggestName(key, keys_));
  }
}

void OptionReader::Fail(const std::string& key, const std::string& value, const std::string& message,
                        const std::string& fix) const {
  faults_.Add(Path(where_, key), value, message, fix);
}

void OptionChecker::Number(const char* key, const double& value, double low, double high) {
  if (!(value >= low && value <= high)) faults_.Add(Path(where_, key), Shown(value), NumberRange(low, high), "");
}

void OptionChecker::Integer(const char* key, const int& value, int low, int high) {
  if (value < low || value > high) faults_.Add(Path(where_, key), Dump(json(value)), IntegerRange(low, high), "");
}

void OptionChecker::Digest(const char* key, const std::string& value) {
  if (!IsBlake2bHex(value)) faults_.Add(Path(where_, key), value, kDigestRule, "");
}

void OptionChecker::Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) {
  if (index < words.size()) return;
  faults_.Add(Path(where_, key), std::to_string(index), "is no value of the enumeration", Suggestion("", words));
}

void OptionChecker::Require(bool condition, const char* key, const char* other, const std::string& value,
                            const std::string& message, const std::string& fix) {
  const bool asked = !faults_.Has(Path(where_, key)) && !faults_.Has(Path(where_, other));
  if (asked && !condition) faults_.Add(Path(where_, key), value, message, fix);
}

}  // namespace legopt
