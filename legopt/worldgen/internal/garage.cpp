#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "legopt/math/random_numbers.h"
#include "legopt/worldgen/internal/building.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

constexpr double kSlab = 0.3;        // thickness of a deck, m
constexpr double kColumn = 0.5;      // edge of a column, m
constexpr double kDeckCell = 1.5;    // mean edge of the cells of a deck, m
constexpr double kColumnCell = 1.0;  // mean edge of the cells of a column, m
constexpr double kParapet = 0.95;    // height of a parapet, m
constexpr double kRampWidth = 3.4;   // width of a ramp, m
constexpr double kStairWidth = 1.6;  // width of the stairs, m

/// Decks extend over x = 0..`length`, y = 0..`width`; ramps lie along the long side at y < 0, stairs at x < 0.
class GarageMaker {
 public:
  explicit GarageMaker(std::uint64_t seed) : generator_(seed), parts_(&building_) {}

  Building Make() {
    building_.kind = BuildingKind::kGarage;
    bays_x_ = 5;
    bays_y_ = 3;
    pitch_x_ = Draw(4.8, 5.4);
    pitch_y_ = Draw(5.0, 5.6);
    storey_ = Draw(2.9, 3.15);
    length_ = bays_x_ * pitch_x_;
    width_ = bays_y_ * pitch_y_;
    building_.storeys_m = {0.0, storey_, 2.0 * storey_};
    building_.height_m = 2.0 * storey_ + kParapet;
    building_.plan = {Eigen::Vector2d(-kStairRun, -2.0 * kRampWidth), Eigen::Vector2d(length_, width_)};
    Note("bays_x", bays_x_);
    Note("bays_y", bays_y_);
    Note("bay_x_m", pitch_x_);
    Note("bay_y_m", pitch_y_);
    Note("storey_m", storey_);
    Ground();
    for (int storey = 0; storey < 2; ++storey) {
      Columns(storey);
      Deck(storey);
      Ramp(storey);
      Stairs(storey);
    }
    Walls();
    Choose();
    Props();
    return std::move(building_);
  }

 private:
  static constexpr double kStairRun = 7.6;

  double Draw(double low, double high) { return low + (high - low) * UniformRandom(generator_); }
  int RandomIndex(int count) { return static_cast<int>(UniformRandom(generator_) * count); }
  void Note(const std::string& name, double value) { building_.parameters.emplace_back(name, value); }
  double Top(int storey) const { return storey_ * (storey + 1); }  ///< top of the deck above `storey`

  void Ground() {
    constexpr double kMargin = 4.0;
    parts_
        .Box("ground", {-kStairRun - kMargin, -2.0 * kRampWidth - kMargin, -0.4},
             {length_ + kMargin, width_ + kMargin, 0.0}, Material::kGround, 0.0)
        .fixed = true;
  }

  void Columns(int storey) {
    const double foot = storey_ * storey;
    const double head = Top(storey) - kSlab;
    for (int i = 0; i <= bays_x_; ++i) {
      for (int j = 0; j <= bays_y_; ++j) {
        const double x = std::clamp(i * pitch_x_, 0.5 * kColumn, length_ - 0.5 * kColumn);
        const double y = std::clamp(j * pitch_y_, 0.5 * kColumn, width_ - 0.5 * kColumn);
        const std::string name = "column-" + std::to_string(storey) + "-" + std::to_string(i) + "-" + std::to_string(j);
        parts_.Box(name, {x - 0.5 * kColumn, y - 0.5 * kColumn, foot}, {x + 0.5 * kColumn, y + 0.5 * kColumn, head},
                   Material::kConcrete, kColumnCell);
      }
    }
  }

  void Deck(int storey) {
    // One member per bay: an undamaged bay is one solid.
    for (int i = 0; i < bays_x_; ++i) {
      for (int j = 0; j < bays_y_; ++j) {
        parts_.Box("deck-" + std::to_string(storey) + "-" + std::to_string(i) + "-" + std::to_string(j),
                   {i * pitch_x_, j * pitch_y_, Top(storey) - kSlab},
                   {(i + 1) * pitch_x_, (j + 1) * pitch_y_, Top(storey)}, Material::kConcrete, kDeckCell);
      }
    }
  }

  /// Adds a ramp from the level below to the deck, along y < 0. The two ramps lie side by side and rise in the same
  /// direction, with a landing at each deck.
  void Ramp(int storey) {
    constexpr double kRun = 13.0;
    constexpr double kThickness = 0.25;
    const double y0 = storey == 0 ? -kRampWidth : -2.0 * kRampWidth;
    const double y1 = y0 + kRampWidth;
    const double foot = storey_ * storey;
    const double head = Top(storey);
    const double start = 3.0;
    const std::string tag = std::to_string(storey);
    // Segments of equal length keep cells short; the lowest wedge starts with zero thickness on the ground.
    constexpr int kFlights = 4;
    for (int k = 0; k < kFlights; ++k) {
      const double xa = start + kRun * k / kFlights;
      const double xb = start + kRun * (k + 1) / kFlights;
      const double za = foot + (head - foot) * k / kFlights;
      const double zb = foot + (head - foot) * (k + 1) / kFlights;
      const double below = storey == 0 ? 0.0 : foot - kThickness;
      std::vector<Vector3d> corners;
      for (const double y : {y0, y1}) {
        corners.emplace_back(xa, y, za);
        corners.emplace_back(xb, y, zb);
        corners.emplace_back(xa, y, std::max(za - kThickness, below));
        corners.emplace_back(xb, y, std::max(zb - kThickness, below));
      }
      parts_.Hull("ramp-" + tag + "-" + std::to_string(k), corners, Material::kConcrete, 1.7);
      if (zb - kThickness - foot < 0.3 && storey == 0) continue;
      Pillar("ramp-pillar-" + tag + "-" + std::to_string(k), xb, y0, zb - kThickness);
    }
    Landing("landing-top-" + tag, start + kRun, start + kRun + 4.5, y0, 0.0, head);
    if (storey == 1) Landing("landing-foot-" + tag, start - 3.0, start, y0, 0.0, foot);
  }

  void Landing(const std::string& name, double xa, double xb, double y0, double y1, double top) {
    parts_.Box(name, {xa, y0, top - kSlab}, {xb, y1, top}, Material::kConcrete, kDeckCell);
    Pillar(name + "-pillar-0", xa + 0.3, y0, top - kSlab);
    Pillar(name + "-pillar-1", xb - 0.3, y0, top - kSlab);
  }

  /// Adds two slender columns from the ground, below the outer and inner edge of a ramp or landing.
  void Pillar(const std::string& name, double x, double y0, double top) {
    constexpr double kEdge = 0.35;
    constexpr double kInset = 0.35;
    if (top < 0.3) return;
    for (const double y : {y0 + kInset, y0 + kRampWidth - kInset}) {
      const std::string full = name + (y < y0 + 1.0 ? "-outer" : "-inner");
      parts_.Box(full, {x - 0.5 * kEdge, y - 0.5 * kEdge, 0.0}, {x + 0.5 * kEdge, y + 0.5 * kEdge, top},
                 Material::kConcrete, kColumnCell);
    }
  }

  /// Adds a straight flight of solid steps towards +x that ends at the deck at x = 0, and a landing for the upper
  /// flight.
  void Stairs(int storey) {
    const int steps = static_cast<int>(std::lround(storey_ / 0.165));
    const double rise = storey_ / steps;
    constexpr double kTread = 0.34;
    constexpr double kStepThickness = 0.3;
    const double foot = storey_ * storey;
    const double run = steps * kTread;
    const double y0 = width_ - (storey == 0 ? 1.0 : 2.0) * kStairWidth - 0.2 * storey;
    for (int k = 0; k < steps; ++k) {
      const double x = -run + k * kTread;
      const double top = foot + (k + 1) * rise;
      const double bottom = std::max(top - rise - kStepThickness, storey == 0 ? 0.0 : foot - kSlab);
      parts_.Box("step-" + std::to_string(storey) + "-" + std::to_string(k), {x, y0, bottom},
                 {x + kTread, y0 + kStairWidth, top}, Material::kConcrete, 0.0);
    }
    for (int k = 1; k <= 2; ++k) {  // walls that support the flight
      const int step = steps * k / 3;
      const double x = -run + step * kTread;
      const double top = foot + step * rise - kStepThickness - 0.001;
      parts_.Box("stair-wall-" + std::to_string(storey) + "-" + std::to_string(k), {x, y0, 0.0},
                 {x + 0.2, y0 + kStairWidth, top}, Material::kConcrete, kColumnCell);
    }
    if (storey == 0) return;
    // The upper flight starts from a walkway along the stairwell at the level of the first deck.
    parts_.Box("stair-walkway", {-run - 1.6, y0, foot - kSlab}, {-run, y0 + kStairWidth, foot}, Material::kConcrete,
               1.6);
    parts_.Box("stair-walkway-side", {-run - 1.6, y0 - 1.5, foot - kSlab}, {0.0, y0, foot}, Material::kConcrete,
               kDeckCell);
    for (const double x : {-run - 1.3, -0.5 * run, -0.6}) {
      parts_.Box("walkway-column" + std::to_string(static_cast<int>(-10 * x)), {x - 0.18, y0 - 1.4, 0.0},
                 {x + 0.18, y0 - 1.04, foot - kSlab}, Material::kConcrete, kColumnCell);
    }
    parts_.Box("walkway-column-corner", {-run - 1.48, y0 + kStairWidth - 0.4, 0.0},
               {-run - 1.12, y0 + kStairWidth, foot - kSlab}, Material::kConcrete, kColumnCell);
  }

  void Walls() {
    constexpr double kThick = 0.2;
    constexpr double kCell = 1.3;
    const double storey_clear = storey_ - kSlab;
    // Back wall with window bands on the ground floor, parapets above; the side of the ramps is open.
    for (int i = 0; i < bays_x_; ++i) {
      const double x0 = i * pitch_x_ + (i == 0 ? kColumn : 0.5 * kColumn);
      const double x1 = (i + 1) * pitch_x_ - (i + 1 == bays_x_ ? kColumn : 0.5 * kColumn);
      parts_.Wall("wall-north-" + std::to_string(i), {x0, width_ - kThick, 0.0}, {x1, width_, storey_clear},
                  Material::kMasonry, kCell, {{0.5, x1 - x0 - 0.5, 1.1, 2.1}});
      for (int deck = 0; deck < 2; ++deck) {
        const double z = Top(deck);
        const double a = deck == 1 ? i * pitch_x_ : x0;
        const double b = deck == 1 ? (i + 1) * pitch_x_ : x1;
        parts_.Box("parapet-north-" + std::to_string(deck) + "-" + std::to_string(i), {a, width_ - kThick, z},
                   {b, width_, z + kParapet}, Material::kMasonry, kCell);
      }
    }
    for (int j = 0; j < bays_y_; ++j) {
      const double y0 = j * pitch_y_ + (j == 0 ? kColumn : 0.5 * kColumn);
      const double y1 = (j + 1) * pitch_y_ - (j + 1 == bays_y_ ? kColumn : 0.5 * kColumn);
      if (j != 1) {
        parts_.Wall("wall-east-" + std::to_string(j), {length_ - kThick, y0, 0.0}, {length_, y1, storey_clear},
                    Material::kMasonry, kCell, {{1.0, 2.6, 1.0, 2.1}});
      }
      for (int deck = 0; deck < 2; ++deck) {
        parts_.Box("parapet-east-" + std::to_string(deck) + "-" + std::to_string(j), {length_ - kThick, y0, Top(deck)},
                   {length_, y1, Top(deck) + kParapet}, Material::kMasonry, kCell);
      }
    }
    // Kiosk on the ground floor: two thin walls with a door and a window.
    parts_.Wall("kiosk-a", {0.6, 3.4, 0.0}, {4.0, 3.55, 2.3}, Material::kMasonry, kCell, {{1.2, 2.2, 0.0, 2.0}});
    parts_.Wall("kiosk-b", {3.85, 0.6, 0.0}, {4.0, 3.4, 2.3}, Material::kMasonry, kCell, {{0.7, 2.0, 1.0, 1.8}});
  }

  /// Chooses the failing columns: one in the middle of the ground floor with two of its neighbours, and one upstairs.
  void Choose() {
    const int i = 2 + RandomIndex(2);
    const int j = 1 + RandomIndex(2);
    const int side = j == 1 ? j + 1 : j - 1;
    building_.foci = {{i * pitch_x_, j * pitch_y_, 0.5 * storey_}};
    Note("failing_column_x", i);
    Note("failing_column_y", j);
    const std::string first = "column-0-" + std::to_string(i) + "-";
    // A second, smaller failure: one column of the upper storey; a third one at the back wall.
    const int upper_i = i == 2 ? 4 : 1;
    const int upper_j = 1 + RandomIndex(2);
    building_.foci.emplace_back(upper_i * pitch_x_, upper_j * pitch_y_, 1.5 * storey_);
    building_.foci.emplace_back((i == 2 ? 3.5 : 4.5) * pitch_x_, width_, storey_ + 0.5 * kParapet);
    const std::array<std::string, 4> names = {first + std::to_string(j), first + std::to_string(side),
                                              "column-0-" + std::to_string(i + 1) + "-" + std::to_string(j),
                                              "column-1-" + std::to_string(upper_i) + "-" + std::to_string(upper_j)};
    for (Member& member : building_.members) {
      for (const std::string& name : names) member.fails = member.fails || member.name == name;
    }
  }

  /// Adds cars in two rows per level, with some empty bays, and people between them.
  void Props() {
    int car = 0;
    for (int level = 0; level < 3; ++level) {
      for (int row = 0; row < 2; ++row) {
        for (int bay = 0; bay < 2 * bays_x_; ++bay) {
          const double chance = UniformRandom(generator_);
          const double x = (bay + 0.5) * 0.5 * pitch_x_ + Draw(-0.12, 0.12);
          const double y = row == 0 ? 0.5 * pitch_y_ + Draw(-0.2, 0.3) : width_ - 0.5 * pitch_y_ + Draw(-0.2, 0.1);
          const double yaw = (row == 0 ? M_PI_2 : -M_PI_2) + Draw(-0.06, 0.06);
          const bool kiosk = level == 0 && row == 0 && bay < 2;
          const bool landing = row == 0 && level > 0 && x > 15.0 && x < 21.0;
          const bool landing_foot = row == 0 && level == 1 && x < 4.0;
          const bool stairs = row == 1 && bay < 1;
          const bool column = NearColumn(x, y);
          if (chance > 0.45 || kiosk || landing || landing_foot || stairs || column) continue;
          parts_.Car("car-" + std::to_string(car++), {x, y, storey_ * level}, yaw);
        }
      }
    }
    Note("cars", car);
    for (int k = 0; k < 4; ++k) {
      const int level = k % 3;
      const double x = Draw(0.25, 0.9) * length_;
      const double y = (0.45 + 0.1 * UniformRandom(generator_)) * width_;
      parts_.Person("person-" + std::to_string(k), {x, y, storey_ * level}, Draw(-M_PI, M_PI), k == 3);
    }
  }

  bool NearColumn(double x, double y) const {
    constexpr double kAlong = 2.15 + 0.5 * kColumn;
    constexpr double kAcross = 0.95 + 0.5 * kColumn;
    for (int i = 0; i <= bays_x_; ++i) {
      for (int j = 0; j <= bays_y_; ++j) {
        if (std::abs(x - i * pitch_x_) < kAcross && std::abs(y - j * pitch_y_) < kAlong) return true;
      }
    }
    return false;
  }

  std::mt19937_64 generator_;
  Building building_;
  BuildingParts parts_;
  int bays_x_ = 0, bays_y_ = 0;
  double pitch_x_ = 0.0, pitch_y_ = 0.0, storey_ = 0.0, length_ = 0.0, width_ = 0.0;
};

}  // namespace

Building MakeGarage(std::uint64_t seed) { return GarageMaker(seed).Make(); }

}  // namespace legopt::worldgen
