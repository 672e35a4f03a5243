#include "tests/simulation/world.h"

#include <algorithm>
#include <utility>

namespace legopt::simulation {

World::World(std::uint64_t seed) : random_(seed), network_(random_()) {
  network_.SetTap([this](bus::Port, std::span<const std::uint8_t> bytes) {
    constexpr std::uint64_t kPrime = 0x100000001B3ULL;
    ++datagrams_;
    for (const std::uint8_t byte : bytes) transcript_ = (transcript_ ^ byte) * kPrime;
  });
}

bool World::Chance(double probability) { return static_cast<double>(random_() >> 11U) * 0x1.0p-53 < probability; }

std::uint64_t World::Below(std::uint64_t bound) { return random_() % bound; }

microseconds World::Within(microseconds low, microseconds high) {
  return low + microseconds(Below(static_cast<std::uint64_t>((high - low).count()) + 1));
}

void World::At(microseconds time, std::function<void()> action) { events_.emplace(time, std::move(action)); }

bool World::Run(const std::function<bool()>& done, microseconds end) {
  while (now() < end) {
    for (Party* party : parties_) {
      if (party->due() <= now()) party->Work();
    }
    while (!events_.empty() && events_.begin()->first <= now()) {
      const std::function<void()> action = std::move(events_.begin()->second);
      events_.erase(events_.begin());
      action();
    }
    if (done()) return true;
    microseconds next = events_.empty() ? end : events_.begin()->first;
    for (const Party* party : parties_) next = std::min(next, party->due());
    network_.AdvanceTo(std::min(end, std::max(now() + kTurn, next)));
  }
  return done();
}

}  // namespace legopt::simulation
