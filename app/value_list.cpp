#include "app/value_list.h"

#include <cstddef>
#include <filesystem>
#include <system_error>

namespace legopt::app {
namespace {

/// Splits a text at commas without a preceding backslash; the parts are unchanged.
std::vector<std::string> PartsOf(std::string_view text) {
  std::vector<std::string> parts(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escaped = text[i] == '\\' && i + 1 < text.size() && text[i + 1] == ',';
    if (text[i] == ',') {
      parts.emplace_back();
    } else {
      parts.back() += text[i];
      if (escaped) parts.back() += text[++i];
    }
  }
  return parts;
}

/// Converts a part to a value: removes backslashes before commas, and blanks at both ends.
std::string ValueOf(const std::string& part) {
  std::string value;
  for (std::size_t i = 0; i < part.size(); ++i) {
    if (part[i] == '\\' && i + 1 < part.size() && part[i + 1] == ',') continue;
    value += part[i];
  }
  const std::size_t first = value.find_first_not_of(' ');
  return first == std::string::npos ? std::string() : value.substr(first, value.find_last_not_of(' ') - first + 1);
}

std::string Joined(const std::vector<std::string>& parts, std::size_t first, std::size_t end) {
  std::string text = parts[first];
  for (std::size_t i = first + 1; i < end; ++i) text += "," + parts[i];
  return text;
}

}  // namespace

std::vector<std::string> SplitValues(std::string_view text, const IsWholeValue& is_whole) {
  const std::vector<std::string> parts = PartsOf(text);
  std::vector<std::string> values;
  for (std::size_t first = 0; first < parts.size();) {
    std::size_t end = is_whole ? parts.size() : first;
    while (end > first && !is_whole(Joined(parts, first, end))) --end;
    values.push_back(end > first ? Joined(parts, first, end) : ValueOf(parts[first]));
    first = std::max(end, first + 1);
  }
  return values;
}

bool IsExistingPath(const std::string& text) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(text, error));
}

}  // namespace legopt::app
