#pragma once

#include <cmath>
#include <numbers>
#include <random>

namespace legopt {

/// Returns a uniform random number in [0, 1) from the upper 53 bits. The distributions of the standard library differ
/// between implementations.
inline double UniformRandom(std::mt19937_64& generator) {
  constexpr int kDroppedBits = 11;
  constexpr double kStep = 0x1.0p-53;
  return static_cast<double>(generator() >> kDroppedBits) * kStep;
}

/// Generator of standard normal random numbers (Box-Muller transform). Not thread-safe.
class NormalRandom {
 public:
  /// Returns the next random number. Every other call takes two uniform ones from `generator`.
  double Next(std::mt19937_64& generator) {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log1p(-UniformRandom(generator)));
    const double angle = 2.0 * std::numbers::pi * UniformRandom(generator);
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

  /// Discards the second number of a pair.
  void Reset() { has_spare_ = false; }

 private:
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace legopt
