#pragma once

#include <cmath>
#include <numbers>
#include <random>

namespace legopt {

/// Uniform in [0, 1), from the upper 53 bits. The standard library's distributions differ between libraries.
inline double UniformDraw(std::mt19937_64& generator) {
  constexpr int kDroppedBits = 11;
  constexpr double kStep = 0x1.0p-53;
  return static_cast<double>(generator() >> kDroppedBits) * kStep;
}

/// Standard normal draws by Box and Muller's transform, two per pair of uniform ones; one thread.
class NormalDraws {
 public:
  /// The next draw; takes two uniform ones from `generator` at every other call.
  double Next(std::mt19937_64& generator) {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log1p(-UniformDraw(generator)));
    const double angle = 2.0 * std::numbers::pi * UniformDraw(generator);
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

  /// Forgets the second draw of a pair.
  void Reset() { has_spare_ = false; }

 private:
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace legopt
