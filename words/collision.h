#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// What the obstacles of a scene are to the solver. Links are convex solids in either case.
enum class SceneRepresentation : std::uint8_t {
  /// Convex solids that fill the scene: a link inside of one is pushed out through its nearest face.
  kSolid,
  /// The paper's (docs/readings.md#two-sided-triangles): every triangle of the scene is an obstacle of its own, flat
  /// and two-sided. There is no inside: a link that meets a triangle is moved off that one triangle by the shortest
  /// way, which for a foot buried deeper than half its height is down.
  kSurface,
  /// The same triangles, one-sided (docs/readings.md#one-sided-triangles): a link that meets one is moved off to its
  /// front, where the shortest way would lead out at its back.
  kOrientedSurface,
};

template <>
inline constexpr auto kWords<SceneRepresentation> =
    Words<SceneRepresentation>({{SceneRepresentation::kSolid, "solid"},
                                {SceneRepresentation::kSurface, "surface"},
                                {SceneRepresentation::kOrientedSurface, "surface_oriented"}});

/// What collision between consecutive waypoints is to a program. The paper has it in the solver although the task does
/// not require it (paper, section V): a preference cannot make a window fail that the task's constraints allow.
enum class ContinuousCollision : std::uint8_t {
  kNone,       ///< does not occur
  kPreferred,  ///< is a preference of its own weight
  kRequired    ///< is a constraint
};

template <>
inline constexpr auto kWords<ContinuousCollision> =
    Words<ContinuousCollision>({{ContinuousCollision::kNone, "none"},
                                {ContinuousCollision::kPreferred, "preferred"},
                                {ContinuousCollision::kRequired, "required"}});

/// Which pairs of links are compared (docs/readings.md#ignored-link-pairs), neighbours left out.
enum class PairSelection : std::uint8_t {
  kReference,  ///< those that do not touch in the dataset's reference pose: the original's
  kAll         ///< all that motion can part: the solid rule's
};

template <>
inline constexpr auto kWords<PairSelection> = Words<PairSelection>({{PairSelection::kReference, "reference"},
                                                                    {PairSelection::kAll, "all"}});

}  // namespace legopt
