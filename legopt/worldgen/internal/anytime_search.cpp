#include "legopt/worldgen/internal/anytime_search.h"

#include <algorithm>
#include <cmath>

namespace legopt::worldgen {

int AnytimeSearch::AddState(double estimate, double least) {
  states_.push_back({.h = estimate, .least = least});
  return static_cast<int>(states_.size()) - 1;
}

void AnytimeSearch::Relax(int from, int to, double cost) {
  const double g = At(from).g + cost;
  State& state = At(to);
  if (g >= state.g || !std::isfinite(state.h)) return;
  state.g = g;
  state.parent = from;
  if (state.round == round_) {
    inconsistent_.insert(to);
    return;
  }
  open_.emplace(g + epsilon_ * state.h, to);
  members_.insert(to);
}

/// Expands states until no open state can improve the goal. Returns false if the effort limit is reached before.
bool AnytimeSearch::Improve(std::int64_t limit) {
  while (!open_.empty()) {
    const auto [f, id] = open_.top();
    if (At(kDone).g <= f) return true;
    if (At(id).round != round_ && id != kDone && expansions_ >= limit) return false;
    open_.pop();
    if (At(id).round == round_ || id == kDone) continue;
    members_.erase(id);
    At(id).round = round_;
    ++expansions_;
    Expand(id);
  }
  return std::isfinite(At(kDone).g);
}

/// Opens all states that may still be improved, with the current epsilon.
void AnytimeSearch::Reopen() {
  members_.insert(inconsistent_.begin(), inconsistent_.end());
  inconsistent_.clear();
  open_ = {};
  for (const int id : members_) open_.emplace(At(id).g + epsilon_ * At(id).h, id);
  ++round_;
}

bool AnytimeSearch::Run(const AnytimeSearchOptions& options) {
  epsilon_ = options.first_epsilon;
  if (!std::isfinite(At(kStart).h)) return false;
  At(kStart).g = 0.0;
  open_.emplace(epsilon_ * At(kStart).h, kStart);
  members_.insert(kStart);
  if (!Improve(options.max_expansions)) return false;
  const std::int64_t limit = expansions_ + options.extra_expansions;
  while (epsilon_ > 1.0) {
    epsilon_ = std::max(1.0, epsilon_ - options.epsilon_step);
    Reopen();
    if (!Improve(limit)) break;
  }
  return true;
}

std::vector<int> AnytimeSearch::Path() const {
  std::vector<int> path;
  for (int id = states_[kDone].parent; id != kStart; id = states_[static_cast<std::size_t>(id)].parent) {
    path.push_back(id);
  }
  path.push_back(kStart);
  std::reverse(path.begin(), path.end());
  return path;
}

double AnytimeSearch::Bound() const {
  double least = cost();
  for (const std::set<int>* set : {&members_, &inconsistent_}) {
    for (const int id : *set) {
      const State& state = states_[static_cast<std::size_t>(id)];
      least = std::min(least, state.g + state.least);
    }
  }
  return std::max(1.0, cost() / least);
}

}  // namespace legopt::worldgen
