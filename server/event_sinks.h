#pragma once

#include <optional>
#include <string>

#include "app/notifier.h"
#include "db/store.h"

namespace legopt::server {

/// Destinations of events other than the database: the log on standard error and the --notify command. Only events that
/// may change a user's plans are sent. Thread rule: one thread.
class EventSinks {
 public:
  /// `command`: value of --notify; nullopt: none. Throws InputError if it does not exist.
  explicit EventSinks(const std::optional<std::string>& command);

  /// Sends an event that is on disk. Never blocks.
  void Take(const db::RecordEvent& event);
  /// Must be called regularly; never blocks.
  void Work();

 private:
  std::optional<app::Notifier> notifier_;
};

}  // namespace legopt::server
