#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// How a part of the robot touches its environment.
enum class ContactKind : std::uint8_t {
  kSole,   ///< flat patch on a surface
  kPoint,  ///< single point or small ball on a surface
  kPalm,   ///< flat patch on a surface, free to turn about the normal
  kRail,   ///< grip around a rail, free to turn about it and to slide along it
};

template <>
inline constexpr auto kEnumNames<ContactKind> = MakeEnumNames<ContactKind>({{ContactKind::kSole, "sole"},
                                                                            {ContactKind::kPoint, "point"},
                                                                            {ContactKind::kPalm, "palm"},
                                                                            {ContactKind::kRail, "rail"}});

/// Touching part of a contact, and the points where forces act.
enum class ContactShape : std::uint8_t {
  kPatch,  ///< points of a flat patch, in the link
  kBall,   ///< lowest point of a ball along the surface's normal
  kBar     ///< points on the x axis of the contact frame, which is the axis of a bar that the robot grips
};

/// Returns true if contacts of this shape have a radius: that of the ball or of the bar.
constexpr bool HasRadius(ContactShape shape) { return shape == ContactShape::kBall || shape == ContactShape::kBar; }

/// Returns true if contacts of this shape have points, all on the x axis of the contact frame.
constexpr bool HasPointsOnAxis(ContactShape shape) { return shape == ContactShape::kBar; }

/// Rotations of the contact frame about its target that a kind leaves free.
enum class FreeRotation : std::uint8_t {
  kNone,
  kAboutNormal,  ///< about the z axis
  kAboutBar,     ///< about the x axis
  kAll
};

/// Forces that a contact can transmit.
enum class ContactForces : std::uint8_t {
  kFrictionCones,  ///< at every point, inside the friction cone about the normal; never pulls
  kBounded         ///< at every point in any direction, each component bounded
};

/// Facts about a kind of contact. Everything that depends on the kind derives from them (CONTRIBUTING.md, "A kind of
/// contact").
struct ContactKindDescription {
  ContactKind kind{};            ///< the described kind
  ContactShape shape{};          ///< touching part
  FreeRotation free_rotation{};  ///< the other rotations must be those of the target
  bool slides = false;           ///< contacts may move along the target's x axis, by up to Contact::slide_m
  ContactForces forces{};        ///< transmitted forces
  int least_points = 1;          ///< minimum number of points, >= 1
  bool supports = false;         ///< its points are corners of the support polygon, and plans walk on it
};

/// Descriptions in the order of the enumerators.
inline constexpr std::array kContactKinds = {
    ContactKindDescription{.kind = ContactKind::kSole,
                           .shape = ContactShape::kPatch,
                           .free_rotation = FreeRotation::kNone,
                           .forces = ContactForces::kFrictionCones,
                           .least_points = 3,
                           .supports = true},
    ContactKindDescription{.kind = ContactKind::kPoint,
                           .shape = ContactShape::kBall,
                           .free_rotation = FreeRotation::kAll,
                           .forces = ContactForces::kFrictionCones,
                           .supports = true},
    ContactKindDescription{.kind = ContactKind::kPalm,
                           .shape = ContactShape::kPatch,
                           .free_rotation = FreeRotation::kAboutNormal,
                           .forces = ContactForces::kFrictionCones,
                           .least_points = 3},
    ContactKindDescription{.kind = ContactKind::kRail,
                           .shape = ContactShape::kBar,
                           .free_rotation = FreeRotation::kAboutBar,
                           .slides = true,
                           .forces = ContactForces::kBounded,
                           .least_points = 2},
};
static_assert(kContactKinds.size() == kNumEnumerators<ContactKind>);

/// Returns the row of `kind` in kContactKinds.
constexpr const ContactKindDescription& DescriptionOf(ContactKind kind) {
  return kContactKinds.at(static_cast<std::size_t>(kind));
}

}  // namespace legopt
