// Random faults of the relays: loss, duplication and delay of datagrams.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <random>
#include <vector>

namespace legopt::chaos {

struct InjectedFaultRates {
  std::uint64_t seed = 1;
  double drop = 0.2;
  double duplicate = 0.05;
  double reorder = 0.1;
  int max_delay_ms = 50;
};

inline void AddFaultRateOptions(CLI::App& app, InjectedFaultRates& options) {
  app.add_option("--seed", options.seed, "Of all misfortune")->capture_default_str();
  app.add_option("--drop", options.drop, "Share of datagrams lost")->capture_default_str();
  app.add_option("--duplicate", options.duplicate, "Share delivered twice")->capture_default_str();
  app.add_option("--reorder", options.reorder, "Share held back by up to 50 ms more")->capture_default_str();
  app.add_option("--max-delay-ms", options.max_delay_ms, "Delay of each, from 0")->capture_default_str();
}

class FaultInjector {
 public:
  explicit FaultInjector(const InjectedFaultRates& options) : options_(options), random_(options.seed) {}

  // Returns the delay of each copy of the next datagram; empty if it is lost.
  std::vector<std::chrono::microseconds> Delays() {
    if (Chance(options_.drop)) return {};
    std::vector<std::chrono::microseconds> delays(Chance(options_.duplicate) ? 2 : 1);
    for (auto& delay : delays) {
      delay = std::chrono::microseconds(random_() % (static_cast<std::uint64_t>(options_.max_delay_ms) * 1000 + 1));
      constexpr int kReorderDelay_ms = 50;  // additional to the normal delay
      if (Chance(options_.reorder)) delay += std::chrono::microseconds(random_() % (kReorderDelay_ms * 1000));
    }
    return delays;
  }

 private:
  bool Chance(double probability) { return static_cast<double>(random_() >> 11U) * 0x1.0p-53 < probability; }

  InjectedFaultRates options_;
  std::mt19937_64 random_;
};

}  // namespace legopt::chaos
