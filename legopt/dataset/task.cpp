#include "legopt/dataset/task.h"

#include "legopt/word_input.h"

namespace legopt {

Task ParseTask(std::string_view text, std::string_view file_for_errors) { return ReadTask(text, file_for_errors); }

Initialization ParseInitialization(std::string_view text, std::string_view file_for_errors) {
  return ReadInitialization(text, file_for_errors);
}

}  // namespace legopt
