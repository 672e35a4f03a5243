#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bus/messages.h"
#include "legopt/types/enum_names.h"

/// @file
/// Roles of keys, and the calls that each role permits. PROTOCOL.md, section 11. Thread rule: none, types and
/// constants.

namespace legopt::bus {

/// Role of the key that made a tag. Without a key every party is an operator.
enum class KeyRole : std::uint8_t {
  kOperator,  ///< full key: every call
  kWorker,    ///< key derived for workers
  kClient,    ///< key derived for clients
};
/// Roles whose keys are derived from the full key.
inline constexpr std::array<KeyRole, 2> kDerivedRoles = {KeyRole::kWorker, KeyRole::kClient};

}  // namespace legopt::bus

/// Names in key files and on command lines.
template <>
inline constexpr auto legopt::kEnumNames<legopt::bus::KeyRole> =
    legopt::MakeEnumNames<legopt::bus::KeyRole>({{legopt::bus::KeyRole::kOperator, "operator"},
                                                 {legopt::bus::KeyRole::kWorker, "worker"},
                                                 {legopt::bus::KeyRole::kClient, "client"}});

namespace legopt::bus {

/// Returns "operator", "worker" or "client".
constexpr std::string_view ToString(KeyRole role) { return legopt::ToString(role); }

/// Roles that may make a call besides operators: the last column of lcmtypes/messages.def.
enum class Callers : std::uint8_t {
  kAnyone,    ///< workers and clients
  kWorkers,   ///< workers only
  kClients,   ///< clients only
  kOperator,  ///< operators only
};

/// Returns the callers of a message type; kOperator for an unknown number.
constexpr Callers CallersOf(MessageType type) {
  switch (type) {
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) \
  case MessageType::k##Name:                     \
    return Callers::k##callers;
#include "lcmtypes/messages.def"
  }
  return Callers::kOperator;
}

/// Returns whether a role's key permits a call. For control calls of clients the server additionally checks the action
/// (server/permission.h).
constexpr bool MayCall(KeyRole role, MessageType type) {
  const Callers callers = CallersOf(type);
  switch (role) {
    case KeyRole::kOperator:
      return true;
    case KeyRole::kWorker:
      return callers == Callers::kAnyone || callers == Callers::kWorkers;
    case KeyRole::kClient:
      return callers == Callers::kAnyone || callers == Callers::kClients;
  }
  return false;
}

/// Returns the message for a refused call or action, which names the action and the required key. `action` is a noun
/// such as "submit" or "delete of an experiment"; `callers` are the permitted roles.
std::string RoleRefusal(KeyRole role, std::string_view action, Callers callers);

}  // namespace legopt::bus
