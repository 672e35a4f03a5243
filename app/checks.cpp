#include "app/checks.h"

#include <charconv>
#include <optional>
#include <utility>

#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::app {
namespace {

// Uses from_chars, because stream conversion depends on the locale and accepts trailing text.
template <class Value>
std::optional<Value> Parse(const std::string& word) {
  Value value{};
  const char* first = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
  const char* last = word.data() + word.size();
  const auto [end, fault] = std::from_chars(first, last, value);
  if (fault != std::errc() || end != last) return std::nullopt;
  return value;
}

std::string Text(double value) { return FormatGeneral(value, 10); }

std::string Got(const std::string& word) { return word.empty() ? " (got nothing)" : " (got '" + word + "')"; }

}  // namespace

std::string Alternatives(const std::vector<std::string>& words) {
  if (words.size() < 2) return Joined(words);
  return Joined({words.begin(), words.end() - 1}) + " or " + words.back();
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

ValueCheck WholeNumber(std::int64_t low, std::int64_t high) {
  const bool bounded = high < std::numeric_limits<std::int64_t>::max();
  const std::string range =
      bounded ? " from " + std::to_string(low) + " to " + std::to_string(high) : " of at least " + std::to_string(low);
  const auto check = [low, high, range](const std::string& word) {
    const auto value = Parse<std::int64_t>(word);
    if (value && *value >= low && *value <= high) return std::string();
    return "must be a whole number" + range + Got(word);
  };
  return {check, "[" + std::to_string(low) + " .. " + (bounded ? std::to_string(high) : "") + "]"};
}

ValueCheck Number(double low, double high) {
  const auto check = [low, high](const std::string& word) {
    const auto value = Parse<double>(word);
    if (value && *value >= low && *value <= high) return std::string();
    return "must be a number from " + Text(low) + " to " + Text(high) + Got(word);
  };
  return {check, "[" + Text(low) + " .. " + Text(high) + "]"};
}

ValueCheck OneOf(std::vector<std::string> words) {
  const std::string list = Joined(words);
  const auto check = [words = std::move(words)](const std::string& word) {
    for (const auto& known : words) {
      if (known == word) return std::string();
    }
    return "'" + word + "' is not known; " + SuggestName(word, words);
  };
  return {check, "{" + list + "}"};
}

}  // namespace legopt::app
