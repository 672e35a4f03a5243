#include "tests/figures/findings.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <thread>

namespace legopt::figures {

void Findings::Begin(const std::string& figure) {
  figure_ = "figure " + figure;
  double load = 0;
  getloadavg(&load, 1);
  std::cout << figure_ << ": load of the machine " << load << " on " << std::thread::hardware_concurrency() << " cores"
            << std::endl;
}

void Findings::Promise(bool holds, const std::string& what) {
  promises_kept_ = promises_kept_ && holds;
  std::cout << figure_ << ": " << (holds ? "" : "BROKEN: ") << what << std::endl;
}

void Findings::Quantity(const std::string& what, double value, double limit, const std::string& unit) {
  limits_kept_ = limits_kept_ && value <= limit;
  std::cout << figure_ << ": " << what << " " << value << " " << unit << " (limit " << limit
            << (value <= limit ? ")" : ", MISSED)") << std::endl;
}

void Findings::Note(const std::string& what) const { std::cout << figure_ << ": " << what << std::endl; }

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  return values[std::max<std::size_t>(rank, 1) - 1];
}

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

bool WaitUntil(const std::function<bool()>& done, std::chrono::milliseconds limit) {
  constexpr std::chrono::milliseconds kBetweenLooks(3);
  const auto end = Clock::now() + limit;
  while (!done()) {
    if (Clock::now() >= end) return false;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  return true;
}

}  // namespace legopt::figures
