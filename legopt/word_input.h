#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "legopt/input_error.h"
#include "words/task.h"
#include "words/words.h"

namespace legopt {

/// The value of a word that stands in `file` under `field`. Throws InputError "unknown WHAT" with the accepted words.
template <Worded Enum>
Enum ReadWord(std::string_view text, std::string_view file, std::string_view field, std::string_view what) {
  if (const std::optional<Enum> value = ParseWord<Enum>(text)) return *value;
  throw InputError({.file = std::string(file),
                    .field = std::string(field),
                    .value = std::string(text),
                    .message = "unknown " + std::string(what),
                    .fix = "use " + WordChoices<Enum>()});
}

/// The task of that name; InputError as ReadWord, under the field "task".
inline Task ReadTask(std::string_view text, std::string_view file) {
  return ReadWord<Task>(text, file, "task", "task");
}

/// Also accepts "in-collision".
inline Initialization ReadInitialization(std::string_view text, std::string_view file) {
  if (text == "in-collision") return Initialization::kInCollision;
  return ReadWord<Initialization>(text, file, "initialization", "initialisation");
}

}  // namespace legopt
