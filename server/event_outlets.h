#pragma once

#include <optional>
#include <string>

#include "db/store.h"
#include "programs/notifier.h"

namespace legopt::server {

/// Where events go beside the database: the log on standard error, and the command of --notify. Only events that may
/// change what a person plans go there. Thread rule: one thread.
class EventOutlets {
 public:
  /// `command`: of --notify; empty: none. Throws InputError when it does not exist.
  explicit EventOutlets(const std::optional<std::string>& command);

  /// An event that is on disk. Never waits.
  void Take(const db::RecordEvent& event);
  /// To be called now and then; never waits.
  void Work();

 private:
  std::optional<programs::Notifier> notifier_;
};

}  // namespace legopt::server
