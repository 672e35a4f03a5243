#pragma once

#include <string_view>

namespace legopt {

/// What a problem asks for: one static posture at a stance, or a motion through a sequence of stances.
enum class Task { kPosture, kMotion };

/// The paper's two starting points: soles above every target, or soles below every target (buried).
enum class Initialization { kGood, kInCollision };

/// "posture" or "motion".
std::string_view ToString(Task task);

/// "good" or "in_collision".
std::string_view ToString(Initialization initialization);

/// Inverse of ToString. Throws InputError naming `file_for_errors` and the accepted words.
Task ParseTask(std::string_view text, std::string_view file_for_errors);

/// Inverse of ToString; also accepts "in-collision". Throws InputError naming `file_for_errors` and the accepted words.
Initialization ParseInitialization(std::string_view text, std::string_view file_for_errors);

}  // namespace legopt
