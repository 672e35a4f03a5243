#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/report/result_source.h"
#include "client/serve/http_server.h"

namespace legopt::client {

/// Returns the metrics of a status reply in the text format of Prometheus, version 0.0.4.
std::string MetricsText(const nlohmann::json& status);

/// Returns the problem of the service that sent this status reply, for /healthz; empty if it is healthy.
std::string HealthFault(const nlohmann::json& status);

/// Answers /healthz (200 "ok", else 503 with the reason) and /metrics from the server or a database file. Thread rule:
/// any thread, one at a time per object.
class Monitoring {
 public:
  explicit Monitoring(SourceOptions source) : source_(std::move(source)) {}

  static bool Answers(const std::string& path) { return path == "/healthz" || path == "/metrics"; }
  HttpReply Answer(const HttpRequest& request) const;

 private:
  nlohmann::json Status() const;

  SourceOptions source_;
};

}  // namespace legopt::client
