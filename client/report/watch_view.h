#pragma once

#include <chrono>

#include "client/service/experiment_status.h"

namespace legopt::client {

using Seconds = std::chrono::duration<double>;

/// Receives events while an experiment is watched.
class WatchView {
 public:
  virtual ~WatchView() = default;
  /// Shows the current status; called a few times per second.
  virtual void Show(const ExperimentStatus& status) = 0;
  /// The server has not answered for `silence`; calls are repeated for up to `patience`. Called once per silence.
  virtual void ServerSilent(Seconds silence, Seconds patience) = 0;
  virtual void ServerBack() = 0;
  /// Called before other output is printed.
  virtual void Break() {}
};

}  // namespace legopt::client
