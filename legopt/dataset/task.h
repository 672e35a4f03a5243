#pragma once

#include <string_view>

#include "words/task.h"

namespace legopt {

/// Inverse of ToString. Throws InputError naming `file_for_errors` and the accepted words.
Task ParseTask(std::string_view text, std::string_view file_for_errors);

/// Inverse of ToString; also accepts "in-collision". Throws InputError naming `file_for_errors` and the accepted words.
Initialization ParseInitialization(std::string_view text, std::string_view file_for_errors);

}  // namespace legopt
