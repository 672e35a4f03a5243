#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// @file
/// The only place that parses and writes JSON. Files, messages, output lines of external solvers and texts from the
/// database are read here. scripts/check-readers forbids calls of the library's own parse() and dump().

namespace legopt {

/// Limits of a JSON text. A text beyond them is rejected before values are created.
struct JsonLimits {
  std::size_t bytes = std::size_t{256} << 20;  ///< length of the text
  std::size_t depth = 64;                      ///< nesting of lists and objects
  std::size_t values = 20'000'000;             ///< number of values, including lists, objects and their members
};

/// Parses one JSON value and skips a byte order mark. Throws InputError with line and byte: text beyond `limits`, text
/// that is not UTF-8, invalid syntax, a NUL character, duplicate keys, numbers beyond the range of double. `source`:
/// file name, or a description of the text's origin.
nlohmann::json ParseJson(std::string_view text, const std::string& source, const JsonLimits& limits = {});
/// Parses like ParseJson; objects keep the order of their keys.
nlohmann::ordered_json ParseOrderedJson(std::string_view text, const std::string& source,
                                        const JsonLimits& limits = {});
/// Parses like ParseJson, but returns no value where that throws. For callers with an error of their own.
std::optional<nlohmann::json> TryParseJson(std::string_view text, const JsonLimits& limits = {});

/// Parses a JSON file. Throws InputError as ParseJson does, and for a file that cannot be read.
nlohmann::json ReadJsonFile(const std::filesystem::path& path, const JsonLimits& limits = {});

/// Formats JSON, on one line if `indent` is negative. Replaces invalid UTF-8 by U+FFFD; never throws.
std::string Dump(const nlohmann::json& json, int indent = -1);
std::string Dump(const nlohmann::ordered_json& json, int indent = -1);  ///< overload for ordered objects

}  // namespace legopt
