#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "legopt/math/random_numbers.h"
#include "legopt/worldgen/internal/building.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

constexpr double kOuter = 0.3;   // thickness of outer walls, m
constexpr double kInner = 0.15;  // thickness of inner walls, m
constexpr double kFloor = 0.25;  // thickness of the upper floor, m
constexpr double kWallCell = 1.3;
constexpr double kFloorCell = 1.35;

/// A rectangle x 0..length, y 0..width: a hall with the stairs in the middle, two rooms on either side.
class HouseMaker {
 public:
  explicit HouseMaker(std::uint64_t seed) : generator_(seed), parts_(&building_) {}

  Building Make() {
    building_.kind = BuildingKind::kHouse;
    length_ = Draw(12.6, 13.6);
    width_ = Draw(9.2, 10.0);
    storey_ = Draw(2.75, 2.95);
    hall_a_ = 0.5 * length_ - 1.55;
    hall_b_ = 0.5 * length_ + 1.55;
    middle_ = 0.5 * width_ + Draw(-0.4, 0.4);
    building_.storeys_m = {0.0, storey_};
    building_.plan = {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(length_, width_)};
    for (const auto& [name, value] : {std::pair("length_m", length_), std::pair("width_m", width_),
                                      std::pair("storey_m", storey_), std::pair("middle_wall_m", middle_)}) {
      building_.parameters.emplace_back(name, value);
    }
    constexpr double kMargin = 4.0;
    parts_.Box("ground", {-kMargin, -kMargin, -0.4}, {length_ + kMargin, width_ + kMargin, 0.0}, Material::kGround, 0.0)
        .fixed = true;
    for (int storey = 0; storey < 2; ++storey) {
      OuterWalls(storey);
      InnerWalls(storey);
    }
    UpperFloor();
    Stairs();
    Roof();
    Furniture();
    Choose();
    return std::move(building_);
  }

 private:
  double Draw(double low, double high) { return low + (high - low) * UniformRandom(generator_); }
  double Foot(int storey) const { return storey * storey_; }
  double Head(int storey) const { return (storey + 1) * storey_ - kFloor; }

  void OuterWalls(int storey) {
    const std::string tag = std::to_string(storey);
    const double z0 = Foot(storey);
    const double z1 = Head(storey) + (storey == 1 ? kFloor : 0.0);
    using Openings = std::vector<BuildingParts::Opening>;
    const Openings windows = {{1.2, 2.9, 0.9, 2.1}, {length_ - 2.9, length_ - 1.2, 0.9, 2.1}};
    Openings front = windows;
    if (storey == 0) front.insert(front.begin() + 1, {hall_a_ + 0.8, hall_a_ + 2.0, 0.0, 2.1});
    if (storey == 1) front.insert(front.begin() + 1, {hall_a_ + 0.8, hall_a_ + 2.2, 0.9, 2.1});
    parts_.Wall("wall-south-" + tag, {0.0, 0.0, z0}, {length_, kOuter, z1}, Material::kMasonry, kWallCell, front);
    Openings back = windows;
    if (storey == 0) back[0] = {1.2, 2.6, 0.0, 2.1};
    parts_.Wall("wall-north-" + tag, {0.0, width_ - kOuter, z0}, {length_, width_, z1}, Material::kMasonry, kWallCell,
                back);
    const double side = width_ - 2.0 * kOuter;
    const Openings ends = {{0.9, 2.3, 0.9, 2.1}, {side - 2.3, side - 0.9, 0.9, 2.1}};
    parts_.Wall("wall-west-" + tag, {0.0, kOuter, z0}, {kOuter, width_ - kOuter, z1}, Material::kMasonry, kWallCell,
                ends);
    parts_.Wall("wall-east-" + tag, {length_ - kOuter, kOuter, z0}, {length_, width_ - kOuter, z1}, Material::kMasonry,
                kWallCell, ends);
  }

  void InnerWalls(int storey) {
    const std::string tag = std::to_string(storey);
    const double z0 = Foot(storey);
    const double z1 = Head(storey) + (storey == 1 ? kFloor : 0.0);
    constexpr double kDoor = 1.1;
    constexpr double kDoorHead = 2.1;
    for (const double x : {hall_a_ - kInner, hall_b_}) {
      const std::string name = (x < hall_a_ ? "wall-hall-west-" : "wall-hall-east-") + tag;
      const double back = width_ - kOuter - kOuter;
      parts_.Wall(name, {x, kOuter, z0}, {x + kInner, width_ - kOuter, z1}, Material::kMasonry, kWallCell,
                  {{0.5, 0.5 + kDoor, 0.0, kDoorHead}, {back - 0.5 - kDoor, back - 0.5, 0.0, kDoorHead}});
    }
    parts_.Wall("wall-rooms-west-" + tag, {kOuter, middle_, z0}, {hall_a_ - kInner, middle_ + kInner, z1},
                Material::kMasonry, kWallCell, {{1.0, 1.0 + kDoor, 0.0, kDoorHead}});
    parts_.Wall("wall-rooms-east-" + tag, {hall_b_ + kInner, middle_, z0}, {length_ - kOuter, middle_ + kInner, z1},
                Material::kMasonry, kWallCell, {{2.2, 2.2 + kDoor, 0.0, kDoorHead}});
  }

  /// Adds the upper floor with a stairwell along the western side of the hall.
  void UpperFloor() {
    const double z0 = Head(0);
    const double z1 = storey_;
    const double well_y0 = WellStart();
    const double well_y1 = well_y0 + StairRun();
    const double well_x = hall_a_ + 1.45;
    const auto slab = [&](const char* name, double xa, double ya, double xb, double yb) {
      parts_.Box(name, {xa, ya, z0}, {xb, yb, z1}, Material::kConcrete, kFloorCell);
    };
    slab("floor-south-west", 0.0, 0.0, hall_a_, middle_);
    slab("floor-north-west", 0.0, middle_, hall_a_, width_);
    slab("floor-south-east", hall_b_, 0.0, length_, middle_);
    slab("floor-north-east", hall_b_, middle_, length_, width_);
    slab("floor-hall-south", hall_a_, 0.0, well_x, well_y0);
    slab("floor-hall-north", hall_a_, well_y1, well_x, width_);
    slab("floor-hall-side", well_x, 0.0, hall_b_, width_);
  }

  int Steps() const { return static_cast<int>(std::lround(storey_ / 0.17)); }
  double StairRun() const { return 0.33 * Steps(); }
  double WellStart() const { return width_ - 1.75 - StairRun(); }

  void Stairs() {
    const int steps = Steps();
    const double rise = storey_ / steps;
    const double tread = StairRun() / steps;
    for (int k = 0; k < steps; ++k) {
      const double y = WellStart() + k * tread;
      parts_.Box("step-" + std::to_string(k), {hall_a_, y, std::max(0.0, k * rise - 0.3)},
                 {hall_a_ + 1.4, y + tread, (k + 1) * rise}, Material::kConcrete, 0.0);
    }
    const int middle = (2 * steps) / 3;
    parts_.Box("stair-wall", {hall_a_, WellStart() + middle * tread, 0.0},
               {hall_a_ + 1.4, WellStart() + middle * tread + 0.2, middle * rise - 0.301}, Material::kMasonry,
               kWallCell);
  }

  /// Adds two slopes of planks over gables; the ridge is parallel to x.
  void Roof() {
    const double eaves = 2.0 * storey_;
    const double ridge = eaves + 0.42 * width_;
    building_.height_m = ridge;
    constexpr double kThick = 0.16;
    const double half = 0.5 * width_;
    const double slope = (ridge - eaves) / half;
    const auto gable = [&](const std::string& name, double x) {
      std::vector<Vector3d> corners;
      for (const double dx : {0.0, kOuter}) {
        corners.emplace_back(x + dx, 0.0, eaves);
        corners.emplace_back(x + dx, width_, eaves);
        corners.emplace_back(x + dx, half, ridge);
      }
      parts_.Hull(name, corners, Material::kMasonry, 1.5);
    };
    gable("gable-west", 0.0);
    gable("gable-middle", 0.5 * length_ - 0.5 * kOuter);
    gable("gable-east", length_ - kOuter);
    constexpr int kStrips = 4;
    for (int side = 0; side < 2; ++side) {
      for (int k = 0; k < kStrips; ++k) {
        const double xa = -0.3 + (length_ + 0.6) * k / kStrips;
        const double xb = -0.3 + (length_ + 0.6) * (k + 1) / kStrips;
        std::vector<Vector3d> corners;
        for (const double t : {-0.4, half}) {  // overhang and ridge
          const double y = side == 0 ? t : width_ - t;
          const double z = eaves + slope * t;
          for (const double x : {xa, xb}) {
            corners.emplace_back(x, y, z);
            corners.emplace_back(x, y, z + kThick);
          }
        }
        parts_.Hull("roof-" + std::to_string(side) + "-" + std::to_string(k), corners, Material::kTimber, 1.8);
      }
    }
  }

  void Table(const std::string& name, const Vector3d& centre, double yaw) {
    constexpr double kHeight = 0.74;
    parts_.TurnedBox(name, centre + Vector3d(0.0, 0.0, 0.5 * kHeight), {1.5, 0.8, kHeight}, yaw, Material::kTimber, 0.0)
        .prop = next_prop_++;
  }

  void Block(const std::string& name, const Vector3d& foot, const Vector3d& size, double yaw) {
    parts_.TurnedBox(name, foot + Vector3d(0.0, 0.0, 0.5 * size.z()), size, yaw, Material::kTimber, 0.0).prop =
        next_prop_++;
  }

  void Furniture() {
    for (int storey = 0; storey < 2; ++storey) {
      const std::string tag = "-" + std::to_string(storey);
      const double z = Foot(storey);
      const double left = 0.5 * hall_a_;
      const double right = 0.5 * (hall_b_ + length_);
      Table("table" + tag, {left + Draw(-0.4, 0.4), 0.45 * middle_ + Draw(-0.2, 0.2), z}, Draw(-0.3, 0.3));
      Block("bed" + tag, {right + Draw(-0.2, 0.3), 0.5 * middle_ + Draw(-0.2, 0.2), z}, {2.0, 1.6, 0.5},
            Draw(-0.1, 0.1));
      Block("sofa" + tag, {left + Draw(-0.3, 0.3), 0.5 * (middle_ + width_) + 0.6, z}, {1.9, 0.85, 0.75},
            Draw(-0.2, 0.2));
      Block("cupboard" + tag, {length_ - kOuter - 0.35, middle_ + 1.6 + Draw(0.0, 0.6), z}, {0.55, 1.2, 1.9}, 0.0);
      Block("chest" + tag, {right + Draw(-0.8, 0.4), 0.55 * (middle_ + width_) + Draw(-0.2, 0.5), z}, {0.9, 0.6, 0.55},
            Draw(-M_PI, M_PI));
    }

    parts_.Person("person-0", {hall_b_ - 0.6, 1.6 + Draw(-0.2, 0.4), 0.0}, Draw(-M_PI, M_PI), false);
    parts_.Person("person-1", {0.7 * hall_a_, middle_ + 1.1, storey_}, Draw(-M_PI, M_PI), true);
    parts_.Car("car-0", {length_ + 2.4, 0.45 * width_, 0.0}, M_PI_2 + Draw(-0.1, 0.1));
  }

  /// Chooses the corner room that collapses: parts of its outer walls fail.
  void Choose() {
    const bool east = UniformRandom(generator_) < 0.5;
    const bool north = UniformRandom(generator_) < 0.5;
    const double x = east ? length_ - 1.5 : 1.5;
    const double y = north ? width_ - 0.5 : 0.5;
    building_.foci = {{x, y, 1.2}, {length_ - x, 0.5 * width_, 2.0 * storey_ + 1.5}};
    building_.parameters.emplace_back("failing_corner_x_m", x);
    building_.parameters.emplace_back("failing_corner_y_m", y);
    const std::string side = std::string("wall-") + (east ? "east" : "west") + "-0-";
    const std::string face = std::string("wall-") + (north ? "north" : "south") + "-0-";
    for (Member& member : building_.members) {
      Vector3d centre = Vector3d::Zero();
      for (const Vector3d& corner : member.corners) centre += corner / static_cast<double>(member.corners.size());
      const bool part = member.name.rfind(side, 0) == 0 || member.name.rfind(face, 0) == 0;
      constexpr double kReach = 3.0;
      member.fails = part && (centre - building_.foci.front()).head<2>().norm() < kReach;
    }
  }

  static constexpr int kFurniture = 1000;  // BuildingParts numbers cars and people from 0
  std::mt19937_64 generator_;
  Building building_;
  BuildingParts parts_;
  int next_prop_ = kFurniture;
  double length_ = 0.0, width_ = 0.0, storey_ = 0.0;
  double hall_a_ = 0.0, hall_b_ = 0.0, middle_ = 0.0;
};

}  // namespace

Building MakeHouse(std::uint64_t seed) { return HouseMaker(seed).Make(); }

}  // namespace legopt::worldgen
