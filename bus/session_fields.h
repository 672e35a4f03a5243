#pragma once

#include "bus/field.h"
#include "bus/field_limits.h"
#include "bus/field_rules.h"
#include "bus/messages.h"
#include "legopt/types/reply.h"

/// @file
/// Fields of the calls that start and end sessions: probe, hello and shutdown.

namespace legopt::bus::fields {

template <>
struct Description<legopt_msg::probe_request> {
  using M = legopt_msg::probe_request;
  static constexpr std::tuple kRows{Field{"nonce", &M::nonce}};
};

template <>
struct Description<legopt_msg::probe_reply> {
  using M = legopt_msg::probe_reply;
  static constexpr std::tuple kRows{Field{"protocol_version", &M::protocol_version, AtLeast{1}},
                                    Field{"server_version", &M::server_version, Text{0, kNameBytes}},
                                    Field{"hostname", &M::hostname, ForHumans(kNameBytes)},
                                    Field{"pid", &M::pid, AtLeast{1}},
                                    Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"database", &M::database, ForHumans(kTextBytes)},
                                    Field{"uptime_us", &M::uptime_us, AtLeast{0}},
                                    Field{"wall_clock_us", &M::wall_clock_us, AtLeast{0}}};
};

template <>
struct Description<legopt_msg::capability> {
  using M = legopt_msg::capability;

  static void HashIsEmptyOrWhole(const M& m, FieldCheck& check) {
    if (!m.hash.empty()) check.Hash("hash", m.hash);
  }

  static constexpr std::tuple kRows{Field{"kind", &M::kind, Text{1, kEnumNameBytes}},
                                    Field{"name", &M::name, Text{0, kNameBytes}},
                                    Field{"hash", &M::hash, Text{0, kEnumNameBytes}, &HashIsEmptyOrWhole}};
};

template <>
struct Description<legopt_msg::hello_request> {
  using M = legopt_msg::hello_request;

  static constexpr std::tuple kRows{
      Field{"protocol_version", &M::protocol_version, AtLeast{1}},
      Field{"worker_name", &M::worker_name, Text{1, kNameBytes}},
      Field{"hostname", &M::hostname, ForHumans(kNameBytes)},
      Field{"pid", &M::pid, AtLeast{1}},
      Field{"slots", &M::slots, Range{1, kMostSlots}},
      Field{"build", &M::build, ForHumans(kNameBytes)},
      Field{"build_id", &M::build_id, Text{1, kEnumNameBytes}},
      Field{"processor", &M::processor, ForHumans(kNameBytes)},
      Field{"processors", &M::processors, Range{1, kMaxProcessors}},
      Field{"memory_bytes", &M::memory_bytes, AtLeast{0}},
      Field{"load", &M::load, NanOrFinite{}, &LoadIsPossible<M>},
      Field{"num_capabilities", &M::num_capabilities, CountOf{&M::capabilities, kMaxCapabilities}},
      Field{"capabilities", &M::capabilities}};
};

template <>
struct Description<legopt_msg::hello_reply> {
  using M = legopt_msg::hello_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<HelloStatus>{}},
                                    Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"worker_id", &M::worker_id, AtLeast{If{&M::status, HelloStatus::kOk, 1, 0}}},
                                    Field{"lease_us", &M::lease_us, Range{0, kLongestLease_us}},
                                    Field{"heartbeat_us", &M::heartbeat_us, Range{0, &M::lease_us}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

template <>
struct Description<legopt_msg::shutdown_request> {
  using M = legopt_msg::shutdown_request;
  static constexpr std::tuple kRows{Field{"nonce", &M::nonce}};
};

template <>
struct Description<legopt_msg::shutdown_reply> {
  using M = legopt_msg::shutdown_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<ShutdownStatus>{}}};
};

}  // namespace legopt::bus::fields
