#pragma once

#include <chrono>

#include "client/service/experiment_status.h"

namespace legopt::client {

using Seconds = std::chrono::duration<double>;

/// What a watcher sees, as it happens.
class WatchView {
 public:
  virtual ~WatchView() = default;
  /// The experiment as of now; a few times per second.
  virtual void Show(const ExperimentStatus& status) = 0;
  /// The server has not answered for `silence`; it is asked again and again for up to `patience`. Once per silence.
  virtual void ServerSilent(Seconds silence, Seconds patience) = 0;
  virtual void ServerBack() = 0;
  /// Something else is about to be printed.
  virtual void Break() {}
};

}  // namespace legopt::client
