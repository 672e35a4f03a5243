#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace legopt::simulation {

/// What became of one history.
struct HistoryOutcome {
  std::vector<std::string> faults;  ///< empty: the service kept its word
  std::uint64_t transcript = 0;     ///< of every byte sent
  std::uint64_t datagrams = 0;
  std::int64_t jobs = 0, attempts = 0, stale = 0;
  std::uint64_t server_lives = 0;
};

/// Plays server, workers and clients under a nemesis for about half a minute of virtual time, lets them come to rest,
/// and checks the outcome. Everything follows from `seed`; every fourth history is on a real database file.
HistoryOutcome PlayHistory(std::uint64_t seed);

}  // namespace legopt::simulation
