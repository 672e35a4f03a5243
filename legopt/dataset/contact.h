#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/problem_definition.h"
#include "legopt/types/contact_kind.h"

namespace legopt {

struct ContactTarget;

/// Contact as declared in a `dataset.yaml` (dataset_file.h), not yet resolved.
///
/// The *contact frame* is fixed in the link. Its z axis is the normal of the touched surface, out of the surface and
/// into the robot; its x axis points forward. A stance states the target pose of this frame in the world.
struct ContactDescription {
  /// Friction coefficient if none is declared, as always in format 1.
  static constexpr double kDefaultFriction = 0.7;

  std::string name;  ///< used by stances; unique in a dataset
  std::string link;  ///< name of a link of the robot
  ContactKind kind = ContactKind::kSole;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< origin of the contact frame in the link frame, m
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();   ///< its orientation: roll, pitch, yaw as in URDF
  std::optional<std::vector<Eigen::Vector3d>> points;  ///< positions in the contact frame, m; default for a sole:
                                                       ///< the lower corners of the link's box
  double radius_m = 0.0;               ///< radius of a point's ball or a rail's bar, >= 0; 0 for other kinds
  double friction = kDefaultFriction;  ///< Coulomb coefficient, in (0, 2]; unused by rails
  std::optional<double> max_normal_N;  ///< bound of the sum of the normal forces, > 0; unused by rails
  double max_force_N = 0.0;            ///< rail: bound of each component of the force at each point, > 0
  double slide_m = 0.0;                ///< rail: largest distance of the grip from its target, along the bar, >= 0

  bool operator==(const ContactDescription&) const = default;
};

/// Gap between a point contact at its target and the surface. Larger than the distance that solvers keep from obstacles
/// (5e-4 m), so that target and collision-free foot do not contradict each other; smaller than the judge's 1 mm.
inline constexpr double kPointClearance_m = 5.5e-4;

/// A part of the robot that may touch its environment; declared once per robot. Immutable and thread-safe.
///
/// A *sole* touches with a patch: its frame must reach the target's pose. A *point* is the lowest point of a ball of
/// `radius_m` around the frame's origin, with any orientation of the link: only the origin has a target, which is
/// `radius_m` and a clearance above the target's position, along its normal. A point without extent has radius 0. A
/// *palm* is a patch that may turn about the surface's normal. A *rail* grips a bar along the x axis of its frame: the
/// hand may turn about the bar, and slide along it by up to `slide_m`. Fingers are not modelled: the axis lies beside
/// the link, at least the bar's radius away.
struct Contact {
  std::string name;    ///< used by stances
  std::string link;    ///< name of the link
  int link_index = 0;  ///< index into RobotModel::links()
  ContactKind kind = ContactKind::kSole;
  Eigen::Isometry3d X_LC;                 ///< contact frame C in the link frame L, m
  std::vector<Eigen::Vector3d> points_L;  ///< points that touch the surface, in the link frame, m; not empty; of a
                                          ///< point contact: the ball's centre
  double radius_m = 0.0;                  ///< radius of a point contact's ball, or of a rail's bar
  Eigen::AlignedBox3d box_L;              ///< AABB of the link's collision geometry in the link frame, m; not empty
  double friction = ContactDescription::kDefaultFriction;  ///< Coulomb coefficient
  std::optional<double> max_normal_N;                      ///< bound of the sum of the normal forces
  double max_force_N = 0.0;                                ///< rail: bound of each component of the force at each point
  double slide_m = 0.0;                                    ///< rail: largest distance from the target along the bar
  /// Position of the frame's origin relative to the base in the nominal posture, m; set by Dataset.
  Eigen::Vector3d nominal_position_B = Eigen::Vector3d::Zero();
  /// Upper bound of the distance of the robot's centre of mass from the frame's origin, in any posture, m
  /// (internal/com_reach.h); set by Dataset. Infinite behind prismatic joints without limits.
  double com_reach_m = 0.0;
  /// Whether the points are declared. Else they are corners of the link's box, as in format 1, and the judge only
  /// reports whether the contact touches (docs/explanation/judge.md#touching).
  bool declares_points = false;

  const ContactKindDescription& facts() const { return DescriptionOf(kind); }
  /// Height of the link frame's origin above the surface along the normal, m. Atlas: 0.082351.
  double link_height_m() const { return X_LC.inverse().translation().z(); }
  /// Returns the rectangle that contains the points, in the contact frame's xy plane, m.
  Eigen::AlignedBox2d Patch() const;
  /// Returns the target of the *link frame* in the world; the target's rotation is only normalised. For a point
  /// contact: the one pose among all admissible ones whose contact frame has the target's orientation.
  Eigen::Isometry3d LinkTarget(const ContactTarget& target) const;
  /// Returns the target of the contact frame's origin in the world, m.
  Eigen::Vector3d OriginTarget(const ContactTarget& target) const;
  /// Returns how far the grip may be from its target along the bar, m; 0 for other kinds than rails.
  double SlideOf(const ContactTarget& target) const;
};

/// Returns the contacts of format 1: one sole per link, named like it, with the contact frame `sole_offset_m` below the
/// link frame.
std::vector<ContactDescription> DescribeSoles(const std::vector<std::string>& links, double sole_offset_m);

/// Returns the common offset if format 1 can express these contacts, else nothing.
std::optional<double> CommonSoleOffset_m(const std::vector<ContactDescription>& contacts);

/// Resolves a description against its link. `link_box` is the AABB of the link's collision geometry, not empty.
Contact ResolveContact(const ContactDescription& description, int link_index, const Eigen::AlignedBox3d& link_box);

class Dataset;
struct Contact;

/// A contact and the pose of its link, for the support polygon.
struct ContactPlacement {
  const Contact* contact = nullptr;  ///< not null; must outlive the placement
  Eigen::Isometry3d X_WL;            ///< link frame in the world
  Eigen::Vector3d normal_W;          ///< unit normal of the touched surface, in the world; used for points only
  bool carries = true;               ///< false: no part of the polygon
};

/// Returns the normal of the touched surface: the z axis of the target's rotation, unit.
Eigen::Vector3d NormalOf(const ContactTarget& target);

/// The set { c : normal . c + offset <= 0 } in the world's xy plane.
struct HalfPlane {
  Eigen::Vector2d normal;  ///< unit, outward
  double offset;           ///< m

  /// Returns the signed distance of c from the edge: > 0 outside.
  double Distance(const Eigen::Vector2d& c) const { return normal.dot(c) + offset; }
};

/// Computes the 2D convex hull, counter-clockwise, without collinear or repeated points (one or two points if all
/// coincide or are collinear). Monotone chain; deterministic.
std::vector<Eigen::Vector2d> ConvexHull2d(std::vector<Eigen::Vector2d> points);

/// Returns the area of a counter-clockwise convex polygon; 0 for fewer than three corners.
double PolygonArea(std::span<const Eigen::Vector2d> polygon);

/// Computes the benchmark's support polygon (docs/explanation/judge.md#support-polygon): hull of the points of all
/// carrying contacts of a supporting kind (contact_kind.h), transformed to the world by X_WL and projected onto xy. A
/// point contact's point is the lowest one of its ball along the normal. Counter-clockwise. For a sole of format 1, the
/// points are the lower corners of the link's box.
std::vector<Eigen::Vector2d> SupportPolygon(std::span<const ContactPlacement> contacts);

/// Returns the contacts that stay between a waypoint of one stance and a waypoint of the next: those with the same
/// target pose in both stances. In the order of `from`. They carry if they do in both, with the smaller friction and
/// slide of the two; no push is asked for.
Stance PlantedContacts(const Dataset& dataset, const Stance& from, const Stance& to);

/// Returns true if every contact of the stance that carries is of a supporting kind: balance is then demanded over the
/// support polygon, as in the paper. Else forces decide (statics/equilibrium_polygon.h).
bool StandsOnFeet(const Dataset& dataset, const Stance& stance);

/// Computes the SupportPolygon of contacts exactly at their targets, for optimizers.
std::vector<Eigen::Vector2d> TargetSupportPolygon(const Dataset& dataset, const Stance& stance);

/// Returns one half-plane per edge of a counter-clockwise convex polygon. A polygon that is only a segment or a point
/// gives four half-planes whose intersection is that segment or point. Aborts for an empty polygon.
std::vector<HalfPlane> Edges(std::span<const Eigen::Vector2d> polygon);

/// Returns the largest signed distance of `c` from the edges: <= 0 inside, > 0 outside.
double SignedDistanceToPolygon(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& c);

}  // namespace legopt
