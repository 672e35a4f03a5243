#include "legopt/worldgen/internal/contact_course.h"

#include <array>
#include <string>
#include <utility>

#include "legopt/math/random_numbers.h"

namespace legopt::worldgen {
namespace {

constexpr std::array kCycles = {1, 2, 3};  // per level
constexpr double kFragment = 0.18;  // share of the trunk's height; less than a stride, so that none covers another
constexpr std::array kStrideOnRubble = {0.24, 0.28, 0.32};  // per level, share of the trunk's height
constexpr std::array kStride = {0.10, 0.12, 0.15};          // per level, share of the trunk's height
constexpr std::array kStationLevel = {ContactLevel::kEasy, ContactLevel::kIntermediate, ContactLevel::kIntermediate};

/// Shuffles 0 .. n - 1 with the same result on every machine.
std::vector<std::size_t> RandomOrder(std::size_t n, std::mt19937_64& generator) {
  std::vector<std::size_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = i;
  for (std::size_t i = n; i > 1; --i) {
    const auto other = static_cast<std::size_t>(UniformRandom(generator) * static_cast<double>(i));
    std::swap(order[i - 1], order[other]);
  }
  return order;
}

}  // namespace

CourseDrawer::CourseDrawer(const std::shared_ptr<const Dataset>& dataset)
    : dataset_(dataset), stations_(dataset, kFragment) {}

Course CourseDrawer::Draw(ContactFamily family, ContactLevel level, std::mt19937_64& generator) {
  const auto index = static_cast<std::size_t>(level);
  Course course{.station = stations_.Draw(family, kStationLevel[index], generator), .stances = {}};
  Station& station = course.station;
  station.level = level;
  const double side = UniformRandom(generator) < 0.5 ? -1.0 : 1.0;
  const Eigen::Vector3d way =
      family == ContactFamily::kRubble ? Eigen::Vector3d(1.0, 0.0, 0.0) : Eigen::Vector3d(0.0, side, 0.0);
  const double share = family == ContactFamily::kRubble ? kStrideOnRubble[index] : kStride[index];
  const Eigen::Vector3d stride = share * dataset_->trunk_height_m() * way;
  const std::vector<std::size_t> order = RandomOrder(station.stance.contacts.size(), generator);
  const Stance first = station.stance;
  Stance stance = first;
  course.stances.push_back(stance);
  for (int cycle = 1; cycle <= kCycles[index]; ++cycle) {
    for (const std::size_t moving : order) {
      Stance without = stance;
      without.contacts.erase(without.contacts.begin() + static_cast<std::ptrdiff_t>(moving));
      course.stances.push_back(std::move(without));
      stance.contacts[moving] =
          stations_.Continue(first.contacts[moving], cycle * stride, std::to_string(cycle), generator, &station);
      course.stances.push_back(stance);
    }
  }
  return course;
}

}  // namespace legopt::worldgen
