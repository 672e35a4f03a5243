#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <vector>

#include "tests/doubles/simulated_network.h"

namespace legopt::simulation {

using std::chrono::microseconds;

/// A participant that acts when a message arrives or a time is reached.
class Party {
 public:
  virtual ~Party() = default;
  /// Takes one turn; called when due() has been reached.
  virtual void Work() = 0;
  /// Returns the time of its next turn; max(): only an event of the world can change anything.
  virtual microseconds due() const = 0;
};

/// Virtual time, random numbers, a network and a list of scheduled actions: a history is determined by the seed.
///
/// Time advances in turns of at least `kTurn`, since processes take time to wake up. Thread safety: one thread.
class World {
 public:
  static constexpr microseconds kTurn{500};

  explicit World(std::uint64_t seed);

  bus::SimulatedNetwork& network() { return network_; }
  microseconds now() const { return network_.now(); }

  /// Random numbers. `probability` in [0, 1]; `bound` > 0: 0 .. bound - 1.
  bool Chance(double probability);
  std::uint64_t Below(std::uint64_t bound);
  std::uint64_t Draw() { return random_(); }
  microseconds Within(microseconds low, microseconds high);

  /// Runs `action` once time has reached `time`; equal times in the order of the calls.
  void At(microseconds time, std::function<void()> action);
  void After(microseconds duration, std::function<void()> action) { At(now() + duration, std::move(action)); }

  /// Adds a party, which must outlive the world's last Run.
  void Add(Party& party) { parties_.push_back(&party); }

  /// Runs until `done` is true (checked after every turn) or `end` is reached; returns whether it was done.
  bool Run(const std::function<bool()>& done, microseconds end);

  /// Returns a hash of every byte sent: equal seeds give equal transcripts.
  std::uint64_t transcript() const { return transcript_; }
  std::uint64_t datagrams() const { return datagrams_; }

 private:
  std::mt19937_64 random_;
  bus::SimulatedNetwork network_;
  std::multimap<microseconds, std::function<void()>> events_;
  std::vector<Party*> parties_;
  std::uint64_t transcript_ = 0;
  std::uint64_t datagrams_ = 0;
};

}  // namespace legopt::simulation
