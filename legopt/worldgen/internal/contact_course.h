#pragma once

#include <memory>
#include <random>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/worldgen/internal/contact_station.h"

namespace legopt::worldgen {

/// A contact sequence over a station that is continued along the way: stances with all contacts, and between them
/// stances that lack the contact that moves.
struct Course {
  Station station;              ///< its stance is the first one; its objects are those of all stances
  std::vector<Stance> stances;  ///< 2 moves + 1
};

/// Draws courses. The robot goes sideways, on rubble forwards. In each cycle every contact moves once by the stride, in
/// an order drawn for the course. The touched surfaces are continued: slopes, walls and tables in their plane, bars by
/// parallel ones, fragments by others of random tilt. Easy courses have one cycle, intermediate ones two, hard ones
/// three with larger strides; the surfaces of hard ones are those of intermediate stations.
///
/// A workspace: not thread-safe. Draws depend on the generator only.
class CourseDrawer {
 public:
  explicit CourseDrawer(const std::shared_ptr<const Dataset>& dataset);

  /// Draws a course. Nothing is checked: most have stances without a posture.
  Course Draw(ContactFamily family, ContactLevel level, std::mt19937_64& generator);

 private:
  std::shared_ptr<const Dataset> dataset_;
  StationDrawer stations_;
};

}  // namespace legopt::worldgen
