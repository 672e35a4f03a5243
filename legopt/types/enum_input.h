#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "legopt/types/enum_names.h"
#include "legopt/types/input_error.h"
#include "legopt/types/task.h"

namespace legopt {

/// Parses an enum name. Throws InputError "unknown WHAT" with the accepted names; `file` and `field` are its location.
template <NamedEnum Enum>
Enum ReadEnum(std::string_view text, std::string_view file, std::string_view field, std::string_view what) {
  if (const std::optional<Enum> value = ParseEnum<Enum>(text)) return *value;
  throw InputError({.file = std::string(file),
                    .field = std::string(field),
                    .value = std::string(text),
                    .message = "unknown " + std::string(what),
                    .fix = "use " + EnumChoices<Enum>()});
}

/// Parses a task. Throws InputError like ReadEnum, with the field "task".
inline Task ReadTask(std::string_view text, std::string_view file) {
  return ReadEnum<Task>(text, file, "task", "task");
}

/// Parses an initialization; also accepts "in-collision".
inline Initialization ReadInitialization(std::string_view text, std::string_view file) {
  if (text == "in-collision") return Initialization::kInCollision;
  return ReadEnum<Initialization>(text, file, "initialization", "initialisation");
}

}  // namespace legopt
