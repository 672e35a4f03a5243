#include "legopt/dataset/task.h"

#include <string>

#include "legopt/input_error.h"

namespace legopt {

Task ParseTask(std::string_view text, std::string_view file_for_errors) {
  if (text == "posture") return Task::kPosture;
  if (text == "motion") return Task::kMotion;
  throw InputError({.file = std::string(file_for_errors),
                    .field = "task",
                    .value = std::string(text),
                    .message = "unknown task",
                    .fix = "use 'posture' or 'motion'"});
}

Initialization ParseInitialization(std::string_view text, std::string_view file_for_errors) {
  if (text == "good") return Initialization::kGood;
  if (text == "in_collision" || text == "in-collision") return Initialization::kInCollision;
  throw InputError({.file = std::string(file_for_errors),
                    .field = "initialization",
                    .value = std::string(text),
                    .message = "unknown initialisation",
                    .fix = "use 'good' or 'in_collision'"});
}

}  // namespace legopt
