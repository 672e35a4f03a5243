#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/report/result_source.h"
#include "client/serve/http_server.h"

namespace legopt::client {

/// Figures of a status reply in the text format of Prometheus, version 0.0.4.
std::string MetricsText(const nlohmann::json& status);

/// The fault of the service that sent this status reply, for /healthz; empty if it is healthy.
std::string HealthFault(const nlohmann::json& status);

/// Answers of /healthz (200 "ok", else 503 with the reason) and /metrics, asked of the server or of a database file.
/// Thread rule: any threads, one at a time for each object.
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
