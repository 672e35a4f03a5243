#include "legopt/worldgen/internal/gait.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace legopt::worldgen {
namespace {

std::vector<int> AllContacts(const ReachCloud& reach) {
  std::vector<int> contacts(static_cast<std::size_t>(reach.num_contacts()));
  std::iota(contacts.begin(), contacts.end(), 0);
  return contacts;
}

Gait Walk(const ReachCloud& reach) {
  std::vector<int> order = AllContacts(reach);
  const auto place = [&](int contact) { return reach.nominal(contact).position; };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    const bool a_right = place(a).y() < 0.0, b_right = place(b).y() < 0.0;
    return a_right != b_right ? b_right : place(a).x() < place(b).x();
  });
  Gait gait{.name = "walk", .phases = {}};
  for (const int contact : order) gait.phases.push_back({contact});
  return gait;
}

Gait EverySecond(const ReachCloud& reach, const std::string& name) {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (int c = 0; c < reach.num_contacts(); ++c) centre += reach.nominal(c).position.head<2>() / reach.num_contacts();
  const auto angle = [&](int contact) {
    const Eigen::Vector2d out = reach.nominal(contact).position.head<2>() - centre;
    return std::atan2(out.y(), out.x());
  };
  std::vector<int> ring = AllContacts(reach);
  std::stable_sort(ring.begin(), ring.end(), [&](int a, int b) { return angle(a) < angle(b); });
  const bool odd = ring.size() % 2 != 0;
  Gait gait{.name = name, .phases = {{}, {}}};
  for (std::size_t k = 0; k + (odd ? 1 : 0) < ring.size(); ++k) gait.phases[k % 2].push_back(ring[k]);
  if (odd) gait.phases.push_back({ring.back()});
  for (std::vector<int>& phase : gait.phases) std::sort(phase.begin(), phase.end());
  return gait;
}

}  // namespace

std::vector<Gait> GaitsOf(const ReachCloud& reach) {
  constexpr int kFour = 4;
  constexpr int kSix = 6;
  const int n = reach.num_contacts();
  std::vector<Gait> gaits;
  if (n == kFour) gaits.push_back(EverySecond(reach, "trot"));
  if (n == kSix) gaits.push_back(EverySecond(reach, "tripod"));
  if (n > kFour && n != kSix) gaits.push_back(EverySecond(reach, "alternating"));
  gaits.push_back(Walk(reach));
  gaits.back().any_order = n != kFour && n != kSix;
  return gaits;
}

}  // namespace legopt::worldgen
