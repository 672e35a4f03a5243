#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// @file
/// The only place that parses and writes JSON. Files, messages, lines of external solvers and texts of a database are
/// read here, whatever their origin. scripts/check-readers refuses calls of the library's own parse() and dump().

namespace legopt {

/// Bounds of a JSON text. Text beyond them is refused before it is turned into values.
struct JsonLimits {
  std::size_t bytes = std::size_t{256} << 20;  ///< length of the text
  std::size_t depth = 64;                      ///< nesting of lists and objects
  std::size_t values = 20'000'000;             ///< number of values, counting lists, objects and their members
};

/// Parses one JSON value. Throws InputError with line and byte: text beyond `limits`, text that is not UTF-8, invalid
/// syntax, a NUL character, a key that an object has twice, a number beyond the range of double. `source` is the file's
/// name, or says where the text comes from. A byte order mark is skipped.
nlohmann::json ParseJson(std::string_view text, const std::string& source, const JsonLimits& limits = {});
/// As ParseJson; objects keep the order of their keys.
nlohmann::ordered_json ParseOrderedJson(std::string_view text, const std::string& source,
                                        const JsonLimits& limits = {});
/// As ParseJson; empty where that throws. For callers whose own error says more.
std::optional<nlohmann::json> TryParseJson(std::string_view text, const JsonLimits& limits = {});

/// Parses a JSON file. Throws InputError as ParseJson does, and for a file that cannot be read.
nlohmann::json ReadJsonFile(const std::filesystem::path& path, const JsonLimits& limits = {});

/// JSON text, on one line when `indent` is negative. Invalid UTF-8 becomes U+FFFD; it never throws.
std::string Dump(const nlohmann::json& json, int indent = -1);
std::string Dump(const nlohmann::ordered_json& json, int indent = -1);  ///< overload for ordered objects

}  // namespace legopt
