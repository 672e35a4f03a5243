#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "legopt/types/contact_kind.h"
#include "legopt/types/enum_names.h"

/// @file
/// The table of the judge's checks. Names of verdicts, messages, database rows, findings on the page and
/// docs/reference/checks.md derive from it. A new check is a row here and a function in
/// legopt/judge/internal/checks.cpp.
///
/// Source: evaluator of the LegOpt benchmark (docs/explanation/judge.md). Stateless, thread-safe.

namespace legopt {

/// Rule by which the judge decides. Each rule includes all checks of the previous one and adds more.
enum class Rule : std::uint8_t {
  kLiteral,  ///< original evaluator's rule
  kStrict,   ///< every listed pair of links, and every contact
  kSolid,    ///< bodies are solid, contacts touch, links do not jump
  kPhysical  ///< friction and the joints' efforts hold the robot
};

template <>
inline constexpr auto kEnumNames<Rule> = MakeEnumNames<Rule>(
    {{Rule::kLiteral, "literal"}, {Rule::kStrict, "strict"}, {Rule::kSolid, "solid"}, {Rule::kPhysical, "physical"}});

/// Success, or the check that failed first, in the order of the checks. kChecks describes each.
enum class Verdict : std::uint8_t {
  kSuccess,
  kWrongWaypointCount,
  kWindowUnsolved,
  kWrongSize,
  kNotFinite,
  kFootPose,
  kCom,
  kJointLimit,
  kEnvironmentCollision,
  kSelfCollision,
  kContainment,
  kStep,
  kTouch,
  kEquilibrium,
  kTorque,
  kPush,
  kTiming,
};

/// Tolerances of the benchmark: larger values fail, equal ones pass (docs/explanation/judge.md#order-and-tolerances).
inline constexpr double kPoseTolerance = 1e-3;     ///< quaternion vector part (1) and translation (m)
inline constexpr double kComTolerance_m = 1e-3;    ///< distance outside the support polygon
inline constexpr double kLimitTolerance = 1e-3;    ///< rad or m beyond a joint limit
inline constexpr double kDepthTolerance_m = 1e-3;  ///< contact depth

inline constexpr double kTouchTolerance_m = 2e-3;       ///< gap between a contact's patch and the surface below it
inline constexpr double kPointTouchTolerance_m = 1e-3;  ///< gap between a point contact and the surface below it

/// Returns the maximum gap of a contact that touches.
constexpr double TouchTolerance_m(ContactKind kind) {
  return DescriptionOf(kind).shape == ContactShape::kBall ? kPointTouchTolerance_m : kTouchTolerance_m;
}

/// Share of a contact's patch that must touch (docs/explanation/judge.md#touching).
inline constexpr double kTouchShare = 0.75;
/// Height of a foot's parts, such as studs, above its lowest place up to which they count as its patch, and the share
/// of the declared patch that their hull must cover. A part at this height is within kTouchTolerance_m of the surface
/// if the foot is 1 mm above it, as at its target, and if the solver leaves another 0.4 mm.
inline constexpr double kPartHeight_m = 5e-4;
inline constexpr double kPartOutlineShare = 0.9;
/// A sole with kTouchShare of its patch within this height of its lowest place is level; others may have parts. A place
/// at this height is within kTouchTolerance_m, as above.
inline constexpr double kLevelHeight_m = 6e-4;

/// Maximum movement of any point of the robot between consecutive waypoints under Rule::kSolid, as a fraction of the
/// robot's size: the diagonal of Dataset::robot_bounds (docs/explanation/judge.md#solid-rule).
inline constexpr double kStepShare = 1.0;

/// Share of a joint's effort limit that a posture may need under Rule::kPhysical.
inline constexpr double kTorqueTolerance = 1.001;

/// Newtons by which the push that a posture resists may fall short of the stance's (Stance::push_N).
inline constexpr double kPushTolerance_N = 1.0;

/// How the page marks a check that failed.
enum class CheckDrawing : std::uint8_t {
  kNone,     ///< only its text
  kContact,  ///< contact off its target
  kCom,      ///< centre of mass and support polygon
  kJoint,    ///< joint and its value
  kOverlap,  ///< pair of bodies and their deepest points
  kLink,     ///< the body of a link, highlighted
};

template <>
inline constexpr auto kEnumNames<CheckDrawing> = MakeEnumNames<CheckDrawing>({{CheckDrawing::kNone, "none"},
                                                                              {CheckDrawing::kContact, "contact"},
                                                                              {CheckDrawing::kCom, "com"},
                                                                              {CheckDrawing::kJoint, "joint"},
                                                                              {CheckDrawing::kOverlap, "overlap"},
                                                                              {CheckDrawing::kLink, "link"}});

/// A check: what it demands, what it measures, and by which rules.
struct CheckDescription {
  Verdict check;                ///< verdict if this check fails first
  std::string_view name;        ///< name in files, messages, databases and on command lines
  std::string_view constraint;  ///< condition that a solution must satisfy
  std::string_view unit;        ///< unit of the measure; empty: the check passes or fails without a number
  double tolerance = 0;         ///< largest value that passes, in the unit; of kStep in robot sizes
  /// Measured quantity of each rule, in the order of Rule; empty: that of the rule before, or none.
  std::array<std::string_view, 4> measures;
  CheckDrawing drawing = CheckDrawing::kNone;

  constexpr bool measured() const { return !unit.empty(); }
  /// The most lenient rule with this check.
  constexpr Rule first_rule() const {
    for (std::size_t i = 0; i < measures.size(); ++i) {
      if (!measures[i].empty()) return static_cast<Rule>(i);
    }
    return Rule::kLiteral;
  }
};

/// All checks, in the order in which they are made at a waypoint; the first row describes success.
inline constexpr std::array kChecks = {
    CheckDescription{Verdict::kSuccess, "success", "all checks of the rule pass", "", 0, {}},
    CheckDescription{Verdict::kWrongWaypointCount,
                     "wrong_waypoint_count",
                     "the solution has the number of waypoints that the task requires",
                     "",
                     0,
                     {"number of waypoints"}},
    CheckDescription{Verdict::kWindowUnsolved,
                     "window_unsolved",
                     "the solver solved every window of a motion",
                     "",
                     0,
                     {"the solver's status"}},
    CheckDescription{Verdict::kWrongSize,
                     "wrong_size",
                     "a waypoint has n + 7 numbers; the time stamps of a path are valid",
                     "",
                     0,
                     {"number of values"}},
    CheckDescription{Verdict::kNotFinite,
                     "not_finite",
                     "all numbers are finite and the base quaternion is not zero",
                     "",
                     0,
                     {"each number"}},
    CheckDescription{Verdict::kFootPose,
                     "foot_pose",
                     "each contact is at its target",
                     "1 or m",
                     kPoseTolerance,
                     {"largest component of the pose error: vector part of the quaternion (1), translation (m)"},
                     CheckDrawing::kContact},
    CheckDescription{Verdict::kCom,
                     "com",
                     "the centre of mass is above the support polygon of the contacts",
                     "m",
                     kComTolerance_m,
                     {"horizontal distance of the centre of mass outside the polygon", "",
                      "the same, with the polygon of all that touches the scene"},
                     CheckDrawing::kCom},
    CheckDescription{Verdict::kJointLimit,
                     "joint_limit",
                     "each joint is within its limits",
                     "rad or m",
                     kLimitTolerance,
                     {"distance beyond the limit"},
                     CheckDrawing::kJoint},
    CheckDescription{Verdict::kEnvironmentCollision,
                     "environment_collision",
                     "no link collides with the scene",
                     "m",
                     kDepthTolerance_m,
                     {"contact depth as in the original evaluator", "depth of all contacts"},
                     CheckDrawing::kOverlap},
    CheckDescription{Verdict::kSelfCollision,
                     "self_collision",
                     "no two links collide",
                     "m",
                     kDepthTolerance_m,
                     {"contact depth of the last colliding pair", "contact depth of all listed pairs",
                      "also of pairs that the original evaluator ignores"},
                     CheckDrawing::kOverlap},
    CheckDescription{Verdict::kContainment,
                     "containment",
                     "no link is inside a closed body, and no body inside a link",
                     "m",
                     kDepthTolerance_m,
                     {"", "", "depth of a vertex inside a closed body; surfaces need not intersect"},
                     CheckDrawing::kOverlap},
    CheckDescription{Verdict::kStep,
                     "step",
                     "no link jumps between consecutive waypoints",
                     "m",
                     kStepShare,
                     {"", "", "largest movement of a point of the robot from the waypoint before"},
                     CheckDrawing::kLink},
    CheckDescription{
        Verdict::kTouch,
        "touch",
        "each contact touches the scene",
        "m",
        kTouchTolerance_m,
        {"", "",
         "gap between link and scene that 75 % of a patch do not exceed; of a point: its gap, at most 0.001 m; of a "
         "rail: gap between bar and grip"},
        CheckDrawing::kNone},
    CheckDescription{
        Verdict::kEquilibrium,
        "equilibrium",
        "contact forces within friction balance the robot's weight",
        "m",
        kComTolerance_m,
        {"only if a hand carries: horizontal distance of the centre of mass outside the equilibrium polygon", "", "",
         "the same for all stances"},
        CheckDrawing::kCom},
    CheckDescription{Verdict::kTorque,
                     "torque",
                     "joints hold the robot within their effort limits",
                     "of the limit",
                     kTorqueTolerance,
                     {"", "", "", "largest share of an effort limit, for the contact forces that make it least"},
                     CheckDrawing::kNone},
    CheckDescription{Verdict::kPush,
                     "push",
                     "the posture resists the push that the stance asks for",
                     "N",
                     kPushTolerance_N,
                     {"", "", "", "required push less the largest one that is resisted in all of 8 directions"},
                     CheckDrawing::kNone},
    CheckDescription{Verdict::kTiming,
                     "timing",
                     "a timed motion has a time law within velocity, effort and friction limits",
                     "",
                     0,
                     {"existence of a time law along the whole motion"},
                     CheckDrawing::kNone}};

/// Returns the tolerance of a check with its unit, as in "0.001 m"; empty for a check without a number.
std::string ToleranceText(const CheckDescription& check);

/// Returns the row of a check.
constexpr const CheckDescription& DescriptionOf(Verdict check) { return kChecks.at(static_cast<std::size_t>(check)); }

/// Returns the names of kChecks as a table of enum names.
consteval auto CheckNames() {
  std::array<EnumName<Verdict>, kChecks.size()> names{};
  for (std::size_t i = 0; i < kChecks.size(); ++i) {
    if (static_cast<std::size_t>(kChecks[i].check) != i) throw "the rows are not in the order of the enumerators";
    names[i] = {kChecks[i].check, kChecks[i].name};
  }
  return names;
}

template <>
inline constexpr auto kEnumNames<Verdict> = CheckNames();

/// Largest value of a check over all waypoints, by the most lenient rule that counts it. It may be within tolerance.
struct Violation {
  Verdict check = Verdict::kSuccess;
  Rule rule = Rule::kLiteral;
  int waypoint = -1;    ///< waypoint of the value, numbered as in the whole motion; -1: unknown
  std::string subject;  ///< contact, joint, link or pair of the value; empty for the value 0, or if unknown
  double value = 0;     ///< largest value, in the unit of the check, >= 0
};

}  // namespace legopt
