// What a measurement of an acceptance figure finds: promises that hold or not, and quantities with their limits.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace legopt::figures {

/// Prints every finding as it comes. Thread rule: one thread.
class Findings {
 public:
  /// Begins a figure; says how loaded the machine is, because every time depends on it.
  void Begin(const std::string& figure);
  /// Something that must hold whatever the machine does.
  void Promise(bool holds, const std::string& what);
  /// A quantity that the figure limits; missing it is a finding only where the machine is idle.
  void Quantity(const std::string& what, double value, double limit, const std::string& unit);
  /// Something that a reader wants to know.
  void Note(const std::string& what) const;

  bool promises_kept() const { return promises_kept_; }
  bool limits_kept() const { return limits_kept_; }

 private:
  std::string figure_;
  bool promises_kept_ = true;
  bool limits_kept_ = true;
};

/// Of `values` (not empty) the one that `share` of them do not exceed.
double Quantile(std::vector<double> values, double share);

using Clock = std::chrono::steady_clock;
double SecondsSince(Clock::time_point begin);
/// Looks every few milliseconds until `done` or `limit`; whether it was done.
bool WaitUntil(const std::function<bool()>& done, std::chrono::milliseconds limit);

}  // namespace legopt::figures
