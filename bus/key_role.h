#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bus/messages.h"
#include "words/words.h"

/// @file
/// The three roles of a key and the calls that each of them may make. PROTOCOL.md, section 11.
/// Thread rule: none, types and constants.

namespace legopt::bus {

/// Role of the party that made a tag. Without a key everybody is an operator.
enum class KeyRole : std::uint8_t {
  kOperator,  ///< has the full key: every call
  kWorker,    ///< has the key derived for workers
  kClient,    ///< has the key derived for clients
};
/// Roles whose keys are derived from the full key.
inline constexpr std::array<KeyRole, 2> kDerivedRoles = {KeyRole::kWorker, KeyRole::kClient};

}  // namespace legopt::bus

/// Words of key files and command lines.
template <>
inline constexpr auto legopt::kWords<legopt::bus::KeyRole> =
    legopt::Words<legopt::bus::KeyRole>({{legopt::bus::KeyRole::kOperator, "operator"},
                                         {legopt::bus::KeyRole::kWorker, "worker"},
                                         {legopt::bus::KeyRole::kClient, "client"}});

namespace legopt::bus {

/// "operator", "worker", "client".
constexpr std::string_view ToString(KeyRole role) { return legopt::ToString(role); }

/// Parties that may make a call, besides operators: the last column of lcmtypes/messages.def.
enum class Callers : std::uint8_t {
  kAnyone,    ///< workers and clients
  kWorkers,   ///< workers alone
  kClients,   ///< clients alone
  kOperator,  ///< neither
};

/// Callers of a message type; kOperator for a number that no call has.
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

/// Whether the holder of a role's key may make a call. Of control, which clients may call, the server refuses some
/// actions (server/permission.h).
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

/// Message for a refused call or action: names the action and the key that permits it. `action` is a noun such as
/// "submit" or "delete of an experiment"; `callers` are the roles with permission.
std::string RoleRefusal(KeyRole role, std::string_view action, Callers callers);

}  // namespace legopt::bus
