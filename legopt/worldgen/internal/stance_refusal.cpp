#include "legopt/worldgen/internal/stance_refusal.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/types/check.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::worldgen {
namespace {

constexpr int kStarts = 3;            // starts per explanation
constexpr std::size_t kExamined = 2;  // stances that are explained

/// Formats 12345 as "12,345".
std::string WithCommas(std::int64_t value) {
  constexpr std::size_t kGroup = 3;
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > kGroup;) {
    at -= kGroup;
    text.insert(at, ",");
  }
  return text;
}

/// Lists the most frequent obstacles with their shares.
std::string ListObstacles(const std::map<std::string, int>& obstacles) {
  constexpr std::size_t kListed = 3;
  constexpr double kPercent = 100.0;
  std::vector<std::pair<int, std::string>> order;
  double sum = 0.0;
  for (const auto& [name, count] : obstacles) {
    order.emplace_back(-count, name);
    sum += count;
  }
  std::sort(order.begin(), order.end());
  std::string text;
  for (std::size_t k = 0; k < std::min(kListed, order.size()); ++k) {
    const int percent = static_cast<int>(std::lround(-order[k].first * kPercent / sum));
    if (k > 0 && percent == 0) break;
    text += (k > 0 ? ", " : "") + std::to_string(percent) + " % " + (k == 0 ? "fail " : "") + order[k].second;
  }
  return text;
}

/// Returns the names of the feet of a stance that have no posture even alone, without collisions and balance.
std::string UnreachableAlone(certify::StanceCertifier& certifier, const Stance& stance) {
  std::string names;
  for (const ContactTarget& target : stance.contacts) {
    if (!certifier.Explain({{target}}, kStarts, {}).without.empty()) continue;
    names += (names.empty() ? "" : ", ") + target.contact;
  }
  return names;
}

/// Sentence about the constraints that prevent postures, and the fix.
std::pair<std::string, std::string> ExplainInfeasible(const ProbeModel& model, const std::vector<Stance>& stances) {
  certify::StanceCertifier certifier(model.dataset);
  std::string text;
  std::string fix;
  for (std::size_t k = 0; k < std::min(kExamined, stances.size()); ++k) {
    const certify::Obstruction obstruction = certifier.Explain(stances[k], kStarts, {});
    if (!obstruction.without.empty()) {
      text += "; stance " + std::to_string(k + 1) + " has a posture " + obstruction.Describe();
      continue;
    }
    const std::string alone = UnreachableAlone(certifier, stances[k]);
    if (!alone.empty()) {
      return {"; joint limits keep even a single foot off its target: " + alone,
              "check its contact frame in dataset.yaml (z out of the surface into the robot, x forward), the limits of "
              "its joints and the nominal posture"};
    }
    text += "; joint limits keep the feet of stance " + std::to_string(k + 1) + " off their common targets";
    fix = "use a smaller --radius (now " + FormatFixed(model.options.reach_m, 3) +
          " m), or check the contact frames and joint limits";
  }
  return {text, fix};
}

/// Fix for the check that fails most often.
std::string FixOf(const std::string& check) {
  const auto starts_with = [&](Verdict verdict) { return check.starts_with(DescriptionOf(verdict).name); };
  if (starts_with(Verdict::kCom)) return "check masses, centres of mass and contact points of the robot";
  if (starts_with(Verdict::kSelfCollision)) {
    return "check the robot for links that always overlap: 'legopt dataset check', key self_collision_reference";
  }
  if (starts_with(Verdict::kEnvironmentCollision)) {
    return "check that the feet end at their contact frames, and that the scene leaves room for the legs";
  }
  return "check contact frames, joint limits, --radius and --slope";
}

}  // namespace

void RefuseStances(const ProbeModel& model, const FailedSampling& failed) {
  const SamplingStatistics& tally = failed.tally;
  InputError::Fault fault{.file = model.dataset->folder().string(),
                          .field = "stances",
                          .value = std::to_string(failed.found) + " of " + std::to_string(failed.wanted),
                          .message = {},
                          .fix = {}};
  const std::string all = tally.Describe();
  const std::int64_t most = std::max({tally.first_foot, tally.second_foot, tally.trunk, tally.infeasible});
  if (failed.found > 0) {
    fault.message = "not enough stances found; " + all;
    fault.fix = "check the scene's walkable ground, the radius and the slope";
  } else if (tally.infeasible == most) {
    fault.message =
        "of " + WithCommas(tally.infeasible) + " stances none has a posture: " + ListObstacles(failed.obstacles);
    auto [why, fix] = ExplainInfeasible(model, failed.infeasible);
    const auto first = std::max_element(failed.obstacles.begin(), failed.obstacles.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
    fault.message += why + " (" + all + ")";
    fault.fix = !fix.empty() || first == failed.obstacles.end() ? fix : FixOf(first->first);
  } else if (tally.first_foot == most) {
    fault.message = "no foot can stand on the ground; " + all;
    fault.fix = "check that the scene has walkable ground larger than the feet, and the slope (--slope, now " +
                FormatFixed(model.options.slope_rad, 3) + " rad)";
  } else if (tally.second_foot == most) {
    fault.message = "no place for the other feet within reach of the first; " + all;
    fault.fix = "use a larger --radius (now " + FormatFixed(model.options.reach_m, 3) + " m), or more level ground";
  } else {
    fault.message = "the trunk is always in collision; " + all;
    fault.fix = "check that the scene leaves room above its ground: the trunk is " +
                FormatFixed(model.options.trunk_m.z(), 3) + " m high, from " +
                FormatFixed(model.options.trunk_low_m, 3) + " m above the feet";
  }
  throw InputError(std::move(fault));
}

}  // namespace legopt::worldgen
