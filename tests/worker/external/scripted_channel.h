#pragma once

#include <deque>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "worker/external/line_channel.h"

namespace legopt::external {

/// A simulated solver in memory. It sends its lines in turn, each computed from the last received message; after the
/// last line it is silent, or ends. Time advances only if nothing is sent: a Receive without a line takes until its
/// deadline.
class ScriptedChannel final : public LineChannel {
 public:
  using Line = std::function<std::string(const nlohmann::json& heard)>;

  ScriptedChannel(std::deque<Line> script, std::vector<nlohmann::json>* heard, bool ends = false)
      : script_(std::move(script)), heard_(heard), ends_(ends) {}

  void Send(std::string_view line, Clock::time_point) override { heard_->push_back(nlohmann::json::parse(line)); }

  std::optional<std::string> Receive(Clock::time_point deadline) override {
    if (script_.empty() && ends_) throw SolverFault("ended with exit code 3");
    if (script_.empty()) {
      while (Clock::now() < deadline) {
      }
      return std::nullopt;
    }
    const Line line = script_.front();
    script_.pop_front();
    return line(heard_->empty() ? nlohmann::json() : heard_->back());
  }

 private:
  std::deque<Line> script_;
  std::vector<nlohmann::json>* heard_;
  bool ends_;
};

}  // namespace legopt::external
