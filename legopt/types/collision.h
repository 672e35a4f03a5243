#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// How the solver treats the obstacles of a scene. Links are always convex solids.
enum class SceneRepresentation : std::uint8_t {
  /// Convex solids that fill the scene. A link inside a solid is pushed out through the nearest face.
  kSolid,
  /// The paper's representation (docs/explanation/paper.md#two-sided-triangles): every triangle of the scene is a
  /// separate flat, two-sided obstacle without an inside. A link that intersects a triangle is moved off it along the
  /// shortest path.
  /// For a foot buried deeper than half its height that path leads down.
  kSurface,
  /// Triangles as in kSurface, but one-sided (docs/explanation/paper.md#one-sided-triangles): a link that intersects a
  /// triangle is always moved to its front, even if the shortest path leads out at the back.
  kOrientedSurface,
};

template <>
inline constexpr auto kEnumNames<SceneRepresentation> =
    MakeEnumNames<SceneRepresentation>({{SceneRepresentation::kSolid, "solid"},
                                        {SceneRepresentation::kSurface, "surface"},
                                        {SceneRepresentation::kOrientedSurface, "surface_oriented"}});

/// How the solver treats collisions between consecutive waypoints. The paper's solver includes them although the task
/// does not require it (paper, section V). A soft cost cannot make a window infeasible that the task's constraints
/// allow.
enum class ContinuousCollision : std::uint8_t {
  kNone,       ///< ignored
  kPreferred,  ///< soft cost with its own weight
  kRequired    ///< hard constraint
};

template <>
inline constexpr auto kEnumNames<ContinuousCollision> =
    MakeEnumNames<ContinuousCollision>({{ContinuousCollision::kNone, "none"},
                                        {ContinuousCollision::kPreferred, "preferred"},
                                        {ContinuousCollision::kRequired, "required"}});

/// Pairs of links checked for self-collision (docs/explanation/judge.md#ignored-link-pairs). Neighbouring links are
/// never checked.
enum class PairSelection : std::uint8_t {
  kReference,  ///< pairs that do not touch in the dataset's reference pose, as in the original evaluator; if the
               ///< dataset has sampled pairs, those that collide in some samples
  kAll         ///< all pairs that joint motion can separate, as in the solid rule
};

template <>
inline constexpr auto kEnumNames<PairSelection> =
    MakeEnumNames<PairSelection>({{PairSelection::kReference, "reference"}, {PairSelection::kAll, "all"}});

/// Why a pair of links is not compared (docs/explanation/judge.md#sampled-link-pairs).
enum class UncheckedReason : std::uint8_t {
  kAdjacent,  ///< pairs with at most one moving joint between them
  kAlways,    ///< they are in collision in more than 95 % of the sampled postures
  kNever,     ///< their hulls are apart in all sampled postures; the solid rule compares them nevertheless
  kStanding,  ///< they overlap wherever the robot stands, with at most three moving joints between them
  kUser       ///< excluded by hand
};

template <>
inline constexpr auto kEnumNames<UncheckedReason> =
    MakeEnumNames<UncheckedReason>({{UncheckedReason::kAdjacent, "adjacent"},
                                    {UncheckedReason::kAlways, "always"},
                                    {UncheckedReason::kNever, "never"},
                                    {UncheckedReason::kStanding, "standing"},
                                    {UncheckedReason::kUser, "user"}});

/// Shapes of link meshes that the solver compares with the scene.
enum class LinkRepresentation : std::uint8_t {
  kHulls,  ///< one hull per mesh, as in the paper
  kPieces  ///< convex pieces of concave meshes, as for scenes
};

template <>
inline constexpr auto kEnumNames<LinkRepresentation> =
    MakeEnumNames<LinkRepresentation>({{LinkRepresentation::kHulls, "hulls"}, {LinkRepresentation::kPieces, "pieces"}});

}  // namespace legopt
