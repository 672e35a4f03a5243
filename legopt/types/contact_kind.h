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

/// Forces that a contact can transmit.
enum class ContactForces : std::uint8_t {
  kFrictionCones,  ///< at every point, inside the friction cone about the normal; never pulls
  kBounded         ///< at every point in any direction, each component bounded
};

/// Picture of a contact on the page and in figures.
enum class ContactDrawing : std::uint8_t { kPatch, kPoint, kRail };

/// What a kind of contact implies. A kind needs terms, a judge's check and a picture before it is `implemented`.
struct ContactKindDescription {
  ContactKind kind{};        ///< the described kind
  int position_rows = 0;     ///< number of constrained components of the position
  int rotation_rows = 0;     ///< number of constrained components of the orientation
  ContactForces forces{};    ///< transmitted forces
  int least_points = 1;      ///< minimum number of points, >= 1
  bool supports = false;     ///< its points are corners of the support polygon
  ContactDrawing drawing{};  ///< picture
  bool implemented = false;  ///< false: datasets with this kind are refused
};

/// Descriptions in the order of the enumerators.
inline constexpr std::array kContactKinds = {
    ContactKindDescription{.kind = ContactKind::kSole,
                           .position_rows = 3,
                           .rotation_rows = 3,
                           .forces = ContactForces::kFrictionCones,
                           .least_points = 3,
                           .supports = true,
                           .drawing = ContactDrawing::kPatch,
                           .implemented = true},
    ContactKindDescription{.kind = ContactKind::kPoint,
                           .position_rows = 3,
                           .rotation_rows = 0,
                           .forces = ContactForces::kFrictionCones,
                           .supports = true,
                           .drawing = ContactDrawing::kPoint,
                           .implemented = true},
    ContactKindDescription{.kind = ContactKind::kPalm,
                           .position_rows = 3,
                           .rotation_rows = 2,
                           .forces = ContactForces::kFrictionCones,
                           .least_points = 3,
                           .drawing = ContactDrawing::kPatch},
    ContactKindDescription{.kind = ContactKind::kRail,
                           .position_rows = 2,
                           .rotation_rows = 2,
                           .forces = ContactForces::kBounded,
                           .least_points = 2,
                           .drawing = ContactDrawing::kRail},
};
static_assert(kContactKinds.size() == kNumEnumerators<ContactKind>);

/// Returns the row of `kind` in kContactKinds.
constexpr const ContactKindDescription& DescriptionOf(ContactKind kind) {
  return kContactKinds.at(static_cast<std::size_t>(kind));
}

}  // namespace legopt
