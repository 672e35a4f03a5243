#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <filesystem>
#include <string>

/// @file
/// The only place that parses YAML. scripts/check-readers forbids calls of the library's own Load functions.

namespace legopt {

/// Limits of a YAML text. A text beyond them is rejected before nodes are created.
struct YamlLimits {
  std::size_t bytes = std::size_t{16} << 20;  ///< length of the text
  std::size_t depth = 64;                     ///< nesting of lists and maps, aliases resolved
  std::size_t values = 1'000'000;             ///< number of values, lists and maps, aliases resolved
};

/// Limits of hand-written files: suites and pool files.
inline constexpr YamlLimits kShortYaml{.bytes = std::size_t{1} << 20, .depth = 64, .values = 100'000};

/// Parses a YAML text with one document: UTF-8, or UTF-16 or UTF-32 with a byte order mark. Throws InputError with line
/// and fix: text beyond `limits`, text that is invalid in its encoding, control characters, invalid syntax, a second
/// document, duplicate keys, keys that are not scalars, merge keys (`<<`), and aliases inside the value they refer to.
/// `source`: file name, or a description of the text's origin.
YAML::Node ParseYaml(const std::string& given, const std::string& source, const YamlLimits& limits = {});

/// Parses a YAML file. Throws InputError as ParseYaml does, and for a file that cannot be read.
YAML::Node ReadYamlFile(const std::filesystem::path& path, const YamlLimits& limits = {});

}  // namespace legopt
