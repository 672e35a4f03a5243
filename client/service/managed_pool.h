#pragma once

#include <chrono>

#include "client/service/server_connection.h"

namespace legopt::client {

/// A server and workers that belong to one command. Thread rule: one thread.
class ManagedPool {
 public:
  virtual ~ManagedPool() = default;

  /// Address of the server, for a ServerConnection.
  virtual const NetworkOptions& network() const = 0;

  /// Must be called a few times per second. Throws ClientError if the server or the workers have given up.
  virtual void Supervise() = 0;

  /// Stops the workers, then the server, so that jobs are released and the database is closed. Running jobs get
  /// `patience` to finish; a second interruption kills immediately.
  virtual void Stop(std::chrono::milliseconds patience) = 0;
};

}  // namespace legopt::client
