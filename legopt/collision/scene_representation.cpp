#include "legopt/collision/scene_representation.h"

#include <string>

#include "legopt/input_error.h"

namespace legopt {

SceneRepresentation ParseSceneRepresentation(std::string_view text, std::string_view file_for_errors) {
  if (text == "solid") return SceneRepresentation::kSolid;
  if (text == "surface") return SceneRepresentation::kSurface;
  throw InputError({.file = std::string(file_for_errors),
                    .field = "collision",
                    .value = std::string(text),
                    .message = "unknown representation of the scene",
                    .fix = "use 'solid' or 'surface'"});
}

}  // namespace legopt
