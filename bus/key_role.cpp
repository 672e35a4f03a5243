#include "bus/key_role.h"

namespace legopt::bus {

std::string RoleRefusal(KeyRole role, std::string_view action, Callers callers) {
  std::string needed = "the full key";
  if (callers == Callers::kWorkers) needed = "a worker's key or the full key";
  if (callers == Callers::kClients) needed = "a client's key or the full key";
  return "a " + std::string(ToString(role)) + "'s key does not permit " + std::string(action) + "; give --key-file " +
         needed;
}

}  // namespace legopt::bus
