#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

/// @file
/// Counters of an endpoint by cause, counted since construction and never reset.

namespace legopt::bus {

/// Counters of an endpoint by cause.
struct Counters {
  // Datagrams.
  std::uint64_t datagrams_sent = 0;      ///< datagrams on both ports, including send_failures
  std::uint64_t datagrams_received = 0;  ///< datagrams on both ports that reached the endpoint
  std::uint64_t bytes_sent = 0;          ///< bytes in datagrams_sent
  std::uint64_t bytes_received = 0;      ///< bytes in datagrams_received
  std::uint64_t not_for_us = 0;          ///< well-formed, addressed to another party
  std::uint64_t send_failures = 0;       ///< refused by the kernel
  std::uint64_t kernel_drops = 0;        ///< lost because the receive buffer was full
  std::uint64_t kernel_filtered = 0;     ///< dropped by the socket filter

  // Calls made by this endpoint.
  std::uint64_t calls_started = 0;      ///< started by Endpoint::Call
  std::uint64_t calls_completed = 0;    ///< ended by a reply
  std::uint64_t calls_rejected = 0;     ///< ended by a refusal
  std::uint64_t calls_timed_out = 0;    ///< ended by their deadline
  std::uint64_t calls_abandoned = 0;    ///< ended by Endpoint::Abandon
  std::uint64_t requests_retried = 0;   ///< repeated requests
  std::uint64_t duplicate_replies = 0;  ///< replies to calls already finished

  // Calls served by this endpoint.
  std::uint64_t requests_handled = 0;       ///< handler invocations
  std::uint64_t duplicate_requests = 0;     ///< repeated requests that did not reach a handler
  std::uint64_t replies_resent = 0;         ///< answered from the cache
  std::uint64_t replies_evicted = 0;        ///< dropped from the full cache before the caller finished
  std::uint64_t requests_refused_busy = 0;  ///< refused because too many requests were open
  std::uint64_t requests_challenged = 0;    ///< requests of sessions without a proof (with a key)
  std::uint64_t handler_failures = 0;       ///< exceptions thrown by handlers

  // Large bodies.
  std::uint64_t objects_sent = 0;      ///< all chunks acknowledged
  std::uint64_t objects_received = 0;  ///< complete, with the correct hash
  std::uint64_t objects_expired = 0;   ///< given up incomplete, in either direction
  std::uint64_t chunks_sent = 0;       ///< first transmissions
  std::uint64_t chunks_resent = 0;     ///< repeats after a loss or as a reminder
  std::uint64_t duplicate_chunks = 0;  ///< received repeatedly

  // Rejected datagrams and messages by cause; each datagram is counted at most once.
  std::uint64_t rejected_size = 0;        ///< empty or above the limit
  std::uint64_t rejected_malformed = 0;   ///< not a frame: fingerprint, lengths, trailing bytes
  std::uint64_t rejected_version = 0;     ///< another protocol version
  std::uint64_t rejected_deployment = 0;  ///< another deployment
  std::uint64_t rejected_tag = 0;         ///< damaged; with a key also forged
  std::uint64_t rejected_unsigned = 0;    ///< datagram tagged without a key, in a deployment with one
  std::uint64_t rejected_replay = 0;      ///< request or proof that is repeated or too old (with a key)
  std::uint64_t rejected_field = 0;       ///< a field of the frame or chunk out of range
  std::uint64_t rejected_type = 0;        ///< request without a handler
  std::uint64_t rejected_role = 0;        ///< request that the role of its key does not permit (with a key)
  std::uint64_t rejected_body = 0;        ///< body not decodable, or a message field out of range
  std::uint64_t rejected_object = 0;      ///< hash mismatch, contradictory chunks, above the limit

  /// Sum of the rejected_* above.
  std::uint64_t rejected() const;
  /// Every counter as (name, value), in the order above; names are those of the fields.
  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

}  // namespace legopt::bus
