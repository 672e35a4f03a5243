#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/dataset.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/geometry/internal/triangle_columns.h"

namespace legopt {

/// Where a contact touches the scene.
struct ContactTouch {
  /// Gap between link and scene, m, >= 0, at most kFarGap_m: of a sole, the one that kTouchShare of the patch do not
  /// exceed; of a point, the smallest one of its surroundings; of a rail, the largest one around its bar.
  double gap_m = 0.0;
  /// Horizontal positions of places that touch, m; their hull is the contact's part of the support polygon.
  std::vector<Eigen::Vector2d> places_W;
};

/// Largest gap that is distinguished from the absence of a surface.
inline constexpr double kFarGap_m = 0.25;

/// Measures whether contacts touch the scene, on the exact meshes of the link, of links fixed to it, and of the scene.
///
/// The *patch* is the hull of the contact's points in the contact frame's xy plane. The *gap* at a place of the patch
/// is the distance, along the frame's z axis, from the lowest surface of the link to the highest surface of the scene
/// below it; a surface up to 5 mm above the link's counts as gap 0, because depth is checked separately. A place
/// touches if its gap is at most kTouchTolerance_m. A foot that cannot touch a plane with kTouchShare of its patch,
/// such as one on studs, balls or a profile (kLevelHeight_m), has a patch of those parts that are within kPartHeight_m
/// of its lowest place, if their hull covers at least kPartOutlineShare of the declared patch; then the hull of what
/// touches must also cover kTouchShare of the hull of the parts. The frame of the *actual* link pose is used, and
/// nothing else of the contact's description, so a wrong description does not pass.
///
/// The patch of a point contact is a disc with the radius of its ball, at least 5 mm, around the lowest point along the
/// normal of its target. It touches if a place or a vertex of the link in it, or the lowest point of a
/// sphere or capsule, has a gap of at most kPointTouchTolerance_m.
///
/// A rail touches if the scene has a bar where the hand grips: from each of the contact's points, in 8 directions
/// across the contact frame's x axis, the scene's next surface is at most the bar's radius and kTouchTolerance_m away.
///
/// Contains workspaces: not thread-safe. Source: docs/explanation/judge.md#touching.
class TouchProbe {
 public:
  /// Both arguments must outlive this object.
  TouchProbe(const Dataset& dataset, const ExactCollision& collision) : dataset_(dataset), collision_(collision) {}

  /// Measures one contact. `normal_W`: normal of its target, for a point; `X_WL`: pose of its link in the world.
  ContactTouch Measure(const Contact& contact, const Eigen::Vector3d& normal_W, const Eigen::Isometry3d& X_WL);

 private:
  /// A place of the patch, in the contact frame.
  struct Place {
    Eigen::Vector2d position;
    double height;  ///< height of the link's lowest surface; TriangleColumns::kNone if there is none
  };
  /// Places of equal area, which make up the patch.
  struct Grid {
    std::vector<Place> places;
    std::vector<std::size_t> neighbour;  ///< per place, the next one in its row, or itself
    std::vector<std::size_t> above;      ///< per place, the next one in its column, or itself
  };
  /// The underside of a link below a patch. It does not move in the contact frame.
  struct Underside {
    TriangleColumns triangles;
    Grid grid;
    std::vector<Place> corners;            ///< corners of the patch and of the link's surface
    Eigen::AlignedBox3d box;               ///< box around all places with a surface
    std::vector<Eigen::Vector3d> bottoms;  ///< lowest points of the link's spheres and of the ends of its capsules
    double outline_m2 = 0.0;  ///< area of the places' hull if the grid has only the parts that touch level ground
  };

  ContactTouch MeasurePatch(const Contact& contact, const Eigen::Isometry3d& X_WL);
  ContactTouch MeasurePoint(const Contact& contact, const Eigen::Vector3d& normal_W, const Eigen::Isometry3d& X_WL);
  ContactTouch MeasureBar(const Contact& contact, const Eigen::Isometry3d& X_WL);
  void CollectScene(const Underside& underside, const Eigen::Isometry3d& X_WC);
  const Underside& UndersideOf(const Contact& contact);
  Underside MakeUnderside(const Contact& contact, const Eigen::Isometry3d& X_CL,
                          const std::vector<Eigen::Vector2d>& patch) const;
  static Grid MakeGrid(const std::vector<Eigen::Vector2d>& patch, std::size_t size, const TriangleColumns& triangles,
                       double ceiling);
  static void AddCorners(const std::vector<Eigen::Vector2d>& patch, Underside* underside);
  /// Returns the vertices of the triangles in the patch, each once, without neighbours.
  static Grid VerticesIn(const std::vector<Eigen::Vector2d>& patch, const TriangleColumns& triangles);
  /// Returns the area of the hull of places.
  static double OutlineArea_m2(const std::vector<Place>& places);
  /// Restricts the patch of a foot that stands on studs or balls to the parts that touch level ground.
  static void KeepTouchingParts(const std::vector<Eigen::Vector2d>& patch, Underside* underside);
  double GapAt(const Place& place) const;
  /// Returns the gap that kTouchShare of the patch do not exceed, from gaps_, whose order it may change. If the patch
  /// consists of parts, the hull of the places within the gap must also cover kTouchShare of the hull of all.
  double GapOfShare(const Underside& underside);
  Place Boundary(const Underside& underside, const Place& touching, const Place& other) const;

  const Dataset& dataset_;
  const ExactCollision& collision_;
  std::map<std::string, Underside> undersides_;  ///< key: name of the contact
  TriangleColumns scene_;                        ///< scene below the measured contact, in the contact frame
  std::vector<double> gaps_;
};

}  // namespace legopt
