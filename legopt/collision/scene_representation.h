#pragma once

#include <string_view>

#include "words/collision.h"

namespace legopt {

/// Inverse of ToString. Throws InputError naming `file_for_errors` and the accepted words.
SceneRepresentation ParseSceneRepresentation(std::string_view text, std::string_view file_for_errors);

}  // namespace legopt
