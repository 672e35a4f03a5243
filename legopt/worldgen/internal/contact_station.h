#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/enum_names.h"

namespace legopt::worldgen {

/// Why a stance is hard to balance.
enum class ContactFamily : std::uint8_t {
  kSlide,   ///< the ground is too steep for the feet alone, whatever the posture
  kReach,   ///< the hands are so far ahead that the centre of mass cannot be over the feet
  kClimb,   ///< one foot is on a high step, hands grip bars
  kRubble,  ///< every foot is on a fragment of its own; for robots without hands
};

/// How hard: steeper, higher, further, fewer hands.
enum class ContactLevel : std::uint8_t { kEasy, kIntermediate, kHard };

}  // namespace legopt::worldgen

namespace legopt {

template <>
inline constexpr auto kEnumNames<worldgen::ContactFamily> =
    MakeEnumNames<worldgen::ContactFamily>({{worldgen::ContactFamily::kSlide, "slide"},
                                            {worldgen::ContactFamily::kReach, "reach"},
                                            {worldgen::ContactFamily::kClimb, "climb"},
                                            {worldgen::ContactFamily::kRubble, "rubble"}});

template <>
inline constexpr auto kEnumNames<worldgen::ContactLevel> =
    MakeEnumNames<worldgen::ContactLevel>({{worldgen::ContactLevel::kEasy, "easy"},
                                           {worldgen::ContactLevel::kIntermediate, "intermediate"},
                                           {worldgen::ContactLevel::kHard, "hard"}});

}  // namespace legopt

namespace legopt::worldgen {

/// A stance, with the solids that its contacts touch. In the frame of the station, whose origin is on the ground below
/// the middle of the feet.
struct Station {
  ContactFamily family{};
  ContactLevel level{};
  std::vector<SceneObject> objects;
  Stance stance;
};

/// Draws stations for a robot: feet near their nominal places, hands where a random posture of the arms has them.
///
/// A workspace: not thread-safe. Draws depend on the generator only.
class StationDrawer {
 public:
  /// Friction of ground and walls.
  static constexpr double kFriction = 0.5;
  /// Friction of one contact of a hard slope.
  static constexpr double kLowFriction = 0.4;

  /// `fragment`: side of a fragment of rubble, as a share of the trunk's height.
  explicit StationDrawer(std::shared_ptr<const Dataset> dataset, double fragment = 0.35);

  /// Returns whether the robot has the contacts that the family needs: hands, or several feet and no hands for kRubble.
  bool Suits(ContactFamily family) const;

  /// Draws a station. Nothing is checked: most have no posture.
  Station Draw(ContactFamily family, ContactLevel level, std::mt19937_64& generator);

  /// Returns a target of the station moved by about `shift`: within its plane, a bar's freely, and a fragment's with
  /// another tilt and height. Adds the object that it touches there; `suffix` distinguishes the names of objects.
  ContactTarget Continue(const ContactTarget& target, const Eigen::Vector3d& shift, const std::string& suffix,
                         std::mt19937_64& generator, Station* station);

 private:
  /// Place of a contact frame in the frame of the station.
  using Frame = Eigen::Isometry3d;

  void DrawSlide(ContactLevel level, std::mt19937_64& generator, Station* station);
  void DrawReach(ContactLevel level, std::mt19937_64& generator, Station* station);
  void DrawClimb(ContactLevel level, std::mt19937_64& generator, Station* station);
  void DrawRubble(ContactLevel level, std::mt19937_64& generator, Station* station);
  /// Adds `count` hands, each of a random kind (`bars_only`: a rail if the hand has one), at a frame of a random
  /// posture of the arm.
  void AddHands(int count, bool bars_only, std::mt19937_64& generator, Station* station);
  void AddContact(const Contact& contact, const Frame& frame, Station* station);
  void AddSlab(const std::string& name, const Frame& top, const Eigen::Vector3d& size, Station* station);
  /// Adds the object that a hand touches: a slab behind a palm, a bar in a grip. Its name ends with `suffix`.
  void AddTouched(const Contact& contact, const Frame& frame, const std::string& suffix, Station* station);
  /// Draws the frame of a fragment near a position.
  Frame DrawFragment(const Eigen::Vector3d& near_position, double spread, double steepest_rad,
                     std::mt19937_64& generator) const;
  std::optional<Frame> DrawHand(const Contact& contact, std::mt19937_64& generator);

  std::shared_ptr<const Dataset> dataset_;
  Kinematics kinematics_;
  Eigen::VectorXd nominal_;  ///< nominal posture, soles on the ground below the origin
  /// Contacts of one hand's link, in the order of the dataset.
  struct Hand {
    std::vector<const Contact*> contacts;
    std::vector<int> dofs;  ///< degrees of freedom of the arm
  };
  std::vector<Hand> hands_;
  double height_m_;    ///< height of the trunk above the ground
  double fragment_m_;  ///< side of a fragment
};

}  // namespace legopt::worldgen
