#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace legopt::simulation {

/// Outcome of one history.
struct HistoryOutcome {
  std::vector<std::string> faults;  ///< empty: all guarantees hold
  std::uint64_t transcript = 0;     ///< hash of every byte sent
  std::uint64_t datagrams = 0;
  std::int64_t jobs = 0, attempts = 0, stale = 0;
  std::uint64_t server_lives = 0;
};

/// Runs server, workers and clients with injected faults for about half a minute of virtual time, lets them come to
/// rest, and checks the outcome. Everything is determined by `seed`; every fourth history uses a real database file.
HistoryOutcome RunHistory(std::uint64_t seed);

}  // namespace legopt::simulation
