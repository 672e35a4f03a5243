#pragma once

#include <nlohmann/json.hpp>
#include <string>

/// @file
/// The interface of the module `legopt-sdf.so`, which reads Gazebo worlds with libsdformat. It is loaded when a world
/// is read, because libsdformat takes time and memory at the start of every program that is linked with it.

namespace legopt {

/// Stores {"objects": [...]} in `world`, or {"field", "value", "message", "fix"} of an error. `text`: the file;
/// `folder`: where it lies.
using ReadSdfFunction = void (*)(const std::string& text, const std::string& folder, nlohmann::json* world);

constexpr char kSdfModule[] = "legopt-sdf.so";
constexpr char kReadSdf[] = "legopt_read_sdf";  ///< the function's symbol

}  // namespace legopt
