#include "client/plot/plot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kTen = 10.0, kTiny = 1e-9;

PlotTick TickAt(double value) { return {value, FormatGeneral(value)}; }

bool Within(const PlotAxis& axis, double value) {
  const double slack = kTiny * std::max(std::abs(axis.from), std::abs(axis.to));
  return value >= axis.from - slack && value <= axis.to + slack;
}

std::vector<PlotTick> Multiples(const PlotAxis& axis, double step) {
  std::vector<PlotTick> ticks;
  const auto first = static_cast<long>(std::ceil(axis.from / step - kTiny));
  for (long i = first; Within(axis, static_cast<double>(i) * step); ++i) {
    ticks.push_back(TickAt(static_cast<double>(i) * step));
  }
  return ticks;
}

std::vector<PlotTick> LinearTicks(const PlotAxis& axis, int most) {
  const double power = std::pow(kTen, std::floor(std::log10((axis.to - axis.from) / most)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    auto ticks = Multiples(axis, factor * power);
    if (ticks.size() <= static_cast<std::size_t>(most)) return ticks;
  }
  return Multiples(axis, 2.0 * kTen * power);
}

// Returns every `stride`-th power of ten, multiplied by each factor.
template <std::size_t kCount>
std::vector<PlotTick> Powers(const PlotAxis& axis, int stride, const std::array<double, kCount>& factors) {
  std::vector<PlotTick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(axis.from))), last = static_cast<int>(std::log10(axis.to));
  for (int power = first; power <= last + 1; ++power) {
    if (power % stride != 0) continue;
    for (const double factor : factors) {
      const double value = factor * std::pow(kTen, power);
      if (Within(axis, value)) ticks.push_back(TickAt(value));
    }
  }
  return ticks;
}

std::vector<PlotTick> LogarithmicTicks(const PlotAxis& axis, int most) {
  constexpr std::size_t kFewest = 2;
  const auto fits = [&](const auto& ticks) {
    return ticks.size() >= kFewest && ticks.size() <= static_cast<std::size_t>(most);
  };
  auto ticks = Powers(axis, 1, std::array{1.0, 2.0, 5.0});
  if (fits(ticks)) return ticks;
  if (ticks.size() < kFewest) return LinearTicks(axis, most);
  for (int stride = 1; !ticks.empty(); ++stride) {
    ticks = Powers(axis, stride, std::array{1.0});
    if (ticks.size() <= static_cast<std::size_t>(most)) return ticks;
  }
  return ticks;
}

}  // namespace

double PlaceOn(const PlotAxis& axis, double value) {
  if (axis.logarithmic) {
    const double least = std::max(value, axis.from);
    return std::clamp(std::log(least / axis.from) / std::log(axis.to / axis.from), 0.0, 1.0);
  }
  return std::clamp((value - axis.from) / (axis.to - axis.from), 0.0, 1.0);
}

std::vector<PlotTick> TicksOf(const PlotAxis& axis, int most) {
  return axis.logarithmic ? LogarithmicTicks(axis, most) : LinearTicks(axis, most);
}

}  // namespace legopt::client
