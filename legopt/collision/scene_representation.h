#pragma once

#include <string_view>

namespace legopt {

/// What the obstacles of a scene are to the solver. Links are convex solids in either case.
enum class SceneRepresentation {
  /// Convex solids that fill the scene: a link inside of one is pushed out through its nearest face.
  kSolid,
  /// The paper's (docs/readings.md#two-sided-triangles): every triangle of the scene is an obstacle of its own, flat
  /// and two-sided. There is no inside: a link that meets a triangle is moved off that one triangle by the shortest
  /// way, which for a foot buried deeper than half its height is down.
  kSurface,
};

/// "solid" or "surface".
std::string_view ToString(SceneRepresentation representation);

/// Inverse of ToString. Throws InputError naming `file_for_errors` and the accepted words.
SceneRepresentation ParseSceneRepresentation(std::string_view text, std::string_view file_for_errors);

}  // namespace legopt
