// Results of measuring an acceptance figure: guarantees that hold or not, and quantities with their limits.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace legopt::figures {

/// Prints every finding immediately. Thread safety: one thread.
class Findings {
 public:
  /// Begins a figure. Prints the load of the machine, since every time depends on it.
  void Begin(const std::string& figure);
  /// Records a guarantee that must hold on any machine.
  void Promise(bool holds, const std::string& what);
  /// Records a quantity limited by the figure; exceeding the limit is a finding only on an idle machine.
  void Quantity(const std::string& what, double value, double limit, const std::string& unit);
  /// Prints additional information.
  void Note(const std::string& what) const;

  bool guarantees_hold() const { return promises_kept_; }
  bool limits_hold() const { return limits_kept_; }

 private:
  std::string figure_;
  bool promises_kept_ = true;
  bool limits_kept_ = true;
};

/// Returns the element of `values` (not empty) that a fraction `share` of them do not exceed.
double Quantile(std::vector<double> values, double share);

using Clock = std::chrono::steady_clock;
double SecondsSince(Clock::time_point begin);
/// Polls every few milliseconds until `done` or `limit`; returns whether it was done.
bool WaitUntil(const std::function<bool()>& done, std::chrono::milliseconds limit);

}  // namespace legopt::figures
