#include "legopt/import/internal/trunk_choice.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>

namespace legopt {
namespace {

/// Chain of bodies from one body to another.
struct Chain {
  int first = 0;  ///< body after the start
  int joints = 0;
};

Chain ChainBetween(const RobotModel& robot, int from, int to) {
  const std::vector<int>& up = robot.body_chain(from);
  const std::vector<int>& down = robot.body_chain(to);
  const auto common = std::ranges::mismatch(up, down);
  const auto rising = std::distance(common.in1, up.end()), falling = std::distance(common.in2, down.end());
  return {.first = rising > 0 ? robot.body_parent(from) : *common.in2, .joints = static_cast<int>(rising + falling)};
}

/// Difference between the most and the fewest joints from a body to the contacts; nothing if two contacts' chains leave
/// by the same joint.
std::optional<int> Imbalance(const RobotModel& robot, int body, const std::set<int>& contact_bodies) {
  std::set<int> leaving;
  int fewest = std::numeric_limits<int>::max(), most = 0;
  for (const int contact : contact_bodies) {
    if (contact == body) return {};
    const Chain chain = ChainBetween(robot, body, contact);
    if (!leaving.insert(chain.first).second) return {};
    fewest = std::min(fewest, chain.joints);
    most = std::max(most, chain.joints);
  }
  return most - fewest;
}

}  // namespace

std::string FindTrunk(const RobotModel& robot, const std::vector<ContactDescription>& contacts) {
  const std::vector<Link>& links = robot.links();
  std::set<int> contact_bodies;
  for (const ContactDescription& contact : contacts) {
    if (const int link = robot.FindLink(contact.link); link >= 0) contact_bodies.insert(robot.link_body(link));
  }
  std::vector<double> masses_kg(static_cast<std::size_t>(robot.num_bodies()));
  for (int link = 0; link < std::ssize(links); ++link) {
    masses_kg[static_cast<std::size_t>(robot.link_body(link))] += links[static_cast<std::size_t>(link)].mass;
  }
  int trunk = 0, least = std::numeric_limits<int>::max();
  double heaviest_kg = 0.0;
  for (int body = 0; contact_bodies.size() > 1 && body < robot.num_bodies(); ++body) {
    const std::optional<int> imbalance = Imbalance(robot, body, contact_bodies);
    const double mass_kg = masses_kg[static_cast<std::size_t>(body)];
    if (!imbalance || *imbalance > least || (*imbalance == least && mass_kg <= heaviest_kg)) continue;
    trunk = body;
    least = *imbalance;
    heaviest_kg = mass_kg;
  }
  const Link* best = nullptr;
  for (int link = 0; link < std::ssize(links); ++link) {
    const Link& candidate = links[static_cast<std::size_t>(link)];
    if (robot.link_body(link) != trunk) continue;
    if (link == 0 && candidate.mass > 0.0) return candidate.name;
    if (best == nullptr || candidate.mass > best->mass) best = &candidate;
  }
  return best->name;
}

}  // namespace legopt
