#pragma once

#include <chrono>

#include "client/service/server_connection.h"

namespace legopt::client {

/// A server and workers of our own, for one command. Thread rule: one thread.
class OwnPool {
 public:
  virtual ~OwnPool() = default;

  /// Where the server listens; for a ServerConnection.
  virtual const NetworkOptions& network() const = 0;

  /// To be called a few times per second. Throws ClientError when server or workers gave up.
  virtual void Supervise() = 0;

  /// Ends the workers, then the server: in order, so that held jobs go back and the database is closed. Running jobs
  /// get `patience` to finish; a second interruption kills at once.
  virtual void Stop(std::chrono::milliseconds patience) = 0;
};

}  // namespace legopt::client
