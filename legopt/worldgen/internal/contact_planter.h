#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/worldgen/contact_dataset.h"
#include "legopt/worldgen/internal/contact_course.h"
#include "legopt/worldgen/internal/station_field.h"

namespace legopt::worldgen {

/// Friction by which a proof must exceed the problem's, so that no tolerance decides it.
inline constexpr double kFrictionMargin = 0.02;
/// Push that a posture must resist from level intermediate on, as a share of the weight.
inline constexpr double kPushShare = 0.05;

/// Returns a proof that the stance slides whatever the posture, even with kFrictionMargin more friction than it has.
std::optional<SlideProof> SlideWithMargin(const Dataset& dataset, const Stance& stance);

/// Area of the equilibrium polygon; 0 without one.
double PolygonArea_m2(const Dataset& dataset, const Stance& stance);

/// Number of contacts that do not support.
int NumHands(const Dataset& dataset, const Stance& stance);

/// Why feet alone do not hold a station, as in the column of features.csv.
std::string FeetAlone(const Dataset& dataset, const Station& station);

/// A station with its planted posture.
struct Planted {
  Station station;
  PlantedPosture posture;
};

/// A course with its planted motion.
struct PlantedCourse {
  Course course;
  PlantedMotion motion;
};

/// Draws stations and courses, and searches their solutions.
class ContactPlanter {
 public:
  using Key = std::pair<ContactFamily, ContactLevel>;

  /// Numbers of stations or courses of a family and level.
  struct Counts {
    int drawn = 0, plausible = 0, solved = 0;
  };

  /// All must outlive this object. `folder`: receives candidates, and loses them again.
  ContactPlanter(const ContactDatasetOptions& options, const std::filesystem::path& folder,
                 const BuildProgress& progress, std::shared_ptr<const Dataset> source)
      : options_(options), folder_(folder), progress_(progress), source_(std::move(source)) {}

  /// Returns the first `wanted` stations that have a posture, or as many as there are.
  std::vector<Planted> Plant(const Key& key, int wanted, Counts* counts);
  /// Returns the first `wanted` courses that have a motion, or as many as there are.
  std::vector<PlantedCourse> PlantCourses(const Key& key, int wanted, Counts* counts);

  /// Returns the generator of draw `number`.
  std::mt19937_64 Generator(const Key& key, const std::string& purpose, int number) const;
  /// Returns one finder per thread.
  std::vector<std::unique_ptr<PostureFinder>> Finders(const std::shared_ptr<const Dataset>& dataset) const;

 private:
  std::vector<Station> DrawPlausible(const Key& key, int first, int number, Counts* counts);
  std::vector<Planted> Solve(const std::vector<Station>& stations);
  std::vector<Course> DrawPlausibleCourses(const Key& key, int first, int number, Counts* counts);
  std::vector<PlantedCourse> SolveCourses(const std::vector<Course>& courses);

  const ContactDatasetOptions& options_;
  const std::filesystem::path& folder_;
  const BuildProgress& progress_;
  std::shared_ptr<const Dataset> source_;
};

}  // namespace legopt::worldgen
