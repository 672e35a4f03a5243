#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Generation of datasets from a seed: damaged buildings, stances and footstep plans.
namespace legopt::worldgen {

/// Types of buildings that can be generated.
enum class BuildingKind {
  kGarage,  ///< MakeGarage
  kHouse    ///< MakeHouse
};

/// Returns "garage" or "house".
std::string_view ToString(BuildingKind kind);
/// Parses a building kind. Throws InputError with the nearest name.
BuildingKind ParseBuildingKind(std::string_view text);

/// Material of a member: determines density, strength of the bonds and colour in pictures.
enum class Material {
  kGround,    ///< ground plate
  kConcrete,  ///< slabs, columns, stairs
  kMasonry,   ///< walls, parapets
  kTimber,    ///< roofs, furniture
  kCar,       ///< hollow: light for its size
  kPerson     ///< density of water
};

/// A convex part of an intact building, in the world frame (m, z up).
struct Member {
  std::string name;                         ///< unique
  std::vector<Eigen::Vector3d> corners;     ///< the member is their convex hull
  Material material = Material::kConcrete;  ///< properties: see FactsOf
  double cell_m = 0.0;                      ///< mean edge length of its fracture cells; 0: cannot break
  int prop = -1;                            ///< members with the same number >= 0 form one loose body (a car, a person)
  bool fixed = false;                       ///< part of the ground
  bool fails = false;                       ///< destroyed when the collapse begins
};

/// An undamaged building.
struct Building {
  BuildingKind kind = BuildingKind::kGarage;
  std::vector<Member> members;                             ///< all parts, including the surroundings
  std::vector<double> storeys_m;                           ///< heights of the walking surfaces, ascending
  Eigen::AlignedBox2d plan;                                ///< outline without the surroundings
  double height_m = 0.0;                                   ///< height of the highest part
  std::vector<Eigen::Vector3d> foci;                       ///< points where the collapse starts, at least one; main one
                                                           ///< first
  std::vector<std::pair<std::string, double>> parameters;  ///< all random or chosen values, for the manifest

  /// Returns the distance of a point from the nearest focus, m.
  double FocusDistance(const Eigen::Vector3d& point) const;
};

/// Builder of convex parts.
class BuildingParts {
 public:
  /// Appends to `building`, which must outlive this object. Adding a part invalidates references to earlier members.
  explicit BuildingParts(Building* building) : building_(building) {}

  /// Adds an axis-aligned box between two opposite corners.
  Member& Box(std::string name, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Material material,
              double cell_m);
  /// Adds a box of full extents `size` about `centre`, rotated by `yaw_rad` about z.
  Member& TurnedBox(std::string name, const Eigen::Vector3d& centre, const Eigen::Vector3d& size, double yaw_rad,
                    Material material, double cell_m);
  /// Adds the convex hull of the corners.
  Member& Hull(std::string name, std::vector<Eigen::Vector3d> corners, Material material, double cell_m);

  /// Adds a parked car: chassis, bonnet and cabin with slanted windows, four wheels. `foot`: centre of its footprint on
  /// the ground.
  void Car(const std::string& name, const Eigen::Vector3d& foot, double yaw_rad);
  /// Adds a person made of simple solids, standing or lying.
  void Person(const std::string& name, const Eigen::Vector3d& foot, double yaw_rad, bool lying);
  /// An opening in a wall: the interval [from, to) along it, between two heights above the wall's base.
  struct Opening {
    double from_m,  ///< start, measured along the wall from its lower end
        to_m,       ///< end, > from_m
        sill_m,     ///< lower edge above the wall's base
        head_m;     ///< upper edge above the wall's base
  };
  /// Adds a wall along x (or y) from `low` to `high`; openings are ascending and disjoint.
  void Wall(const std::string& name, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Material material,
            double cell_m, const std::vector<Opening>& openings);

 private:
  Building* building_;
  int next_prop_ = 0;
};

/// Generates a multi-storey car park of about 26 x 17 m: ground slab, two decks on columns, parapets, ramps, a
/// staircase, parked cars and people. Dimensions, parking and the failing columns depend on the seed.
Building MakeGarage(std::uint64_t seed);

/// Generates a detached house of about 13 x 10 m with two storeys and a pitched roof: rooms with doors and windows, a
/// straight staircase, furniture and people.
Building MakeHouse(std::uint64_t seed);

/// Generates a building of the given kind.
Building MakeBuilding(BuildingKind kind, std::uint64_t seed);

}  // namespace legopt::worldgen
