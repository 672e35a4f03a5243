#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Damaged buildings, stances and plans: a dataset from a seed.
namespace legopt::generate {

/// The intact buildings that can be generated.
enum class BuildingKind {
  kGarage,  ///< MakeGarage
  kHouse    ///< MakeHouse
};

/// "garage" or "house".
std::string_view ToString(BuildingKind kind);
/// Inverse; throws InputError naming the nearest word.
BuildingKind ParseBuildingKind(std::string_view text);

/// What a member is made of: decides its density, the strength of its bonds and its colour in pictures.
enum class Material {
  kGround,    ///< the plate that all stands on
  kConcrete,  ///< slabs, columns, stairs
  kMasonry,   ///< walls, parapets
  kTimber,    ///< roofs, furniture
  kCar,       ///< hollow: light for its size
  kPerson     ///< as heavy as water
};

/// A convex part of an intact building, in the world frame (m, z up).
struct Member {
  std::string name;                         ///< unique
  std::vector<Eigen::Vector3d> corners;     ///< their hull is the member
  Material material = Material::kConcrete;  ///< of its facts see FactsOf
  double cell_m = 0.0;                      ///< mean edge of the cells that it breaks into; 0: stays whole
  int prop = -1;                            ///< members with the same number >= 0 are one loose body (a car, a person)
  bool fixed = false;                       ///< part of the ground
  bool fails = false;                       ///< crushed when the collapse begins
};

/// An undamaged building. A plain value.
struct Building {
  BuildingKind kind = BuildingKind::kGarage;               ///< which of the buildings
  std::vector<Member> members;                             ///< all parts, surroundings included
  std::vector<double> storeys_m;                           ///< heights of the walking surfaces, ascending
  Eigen::AlignedBox2d plan;                                ///< of the building without its surroundings
  double height_m = 0.0;                                   ///< of its highest part
  std::vector<Eigen::Vector3d> foci;                       ///< where the collapse starts, at least one; main one first
  std::vector<std::pair<std::string, double>> parameters;  ///< everything that was drawn or chosen, for the manifest

  /// Distance of a point from the nearest focus, m.
  double FocusDistance(const Eigen::Vector3d& point) const;
};

/// Adds convex parts by their usual descriptions.
class BuildingParts {
 public:
  /// Appends to `building`, which must outlive this. References to members are void after the next part.
  explicit BuildingParts(Building* building) : building_(building) {}

  /// Upright box from its lowest to its highest corner.
  Member& Box(std::string name, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Material material,
              double cell_m);
  /// Box of full extents `size` about `centre`, turned by `yaw_rad` about z.
  Member& TurnedBox(std::string name, const Eigen::Vector3d& centre, const Eigen::Vector3d& size, double yaw_rad,
                    Material material, double cell_m);
  /// Hull of the corners.
  Member& Hull(std::string name, std::vector<Eigen::Vector3d> corners, Material material, double cell_m);

  /// A parked car: chassis, bonnet and cabin with slanted windows, four wheels. Centre of its footprint on the ground.
  void Car(const std::string& name, const Eigen::Vector3d& foot, double yaw_rad);
  /// A standing (or lying) person of simple solids.
  void Person(const std::string& name, const Eigen::Vector3d& foot, double yaw_rad, bool lying);
  /// An opening of a wall: the interval [from, to) along it, between two heights above its foot.
  struct Opening {
    double from_m,  ///< along the wall, from its lower end
        to_m,       ///< likewise, > from_m
        sill_m,     ///< lower edge above the wall's foot
        head_m;     ///< upper edge above the wall's foot
  };
  /// Wall along x (or y) from `low` to `high`; openings are ascending and disjoint.
  void Wall(const std::string& name, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Material material,
            double cell_m, const std::vector<Opening>& openings);

 private:
  Building* building_;
  int next_prop_ = 0;
};

/// A multi-storey car park of about 26 x 17 m: ground slab, two decks on columns, parapets, ramps, a staircase, parked
/// cars and people. Dimensions, parking and the failing columns vary with the seed.
Building MakeGarage(std::uint64_t seed);

/// A detached house of about 13 x 10 m with two storeys and a pitched roof: rooms with doors and windows, a straight
/// staircase, furniture and people.
Building MakeHouse(std::uint64_t seed);

/// The building of that kind.
Building MakeBuilding(BuildingKind kind, std::uint64_t seed);

}  // namespace legopt::generate
