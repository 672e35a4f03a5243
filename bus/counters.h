#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

/// @file
/// What an endpoint has seen, by cause. Plain numbers, counted since construction, never reset.

namespace legopt::bus {

/// What an endpoint has seen, by cause.
struct Counters {
  // Datagrams.
  std::uint64_t datagrams_sent = 0;      ///< on both ports, send_failures included
  std::uint64_t datagrams_received = 0;  ///< on both ports: all that reached the endpoint
  std::uint64_t bytes_sent = 0;          ///< of datagrams_sent
  std::uint64_t bytes_received = 0;      ///< of datagrams_received
  std::uint64_t not_for_us = 0;          ///< well-formed, addressed to another party
  std::uint64_t send_failures = 0;       ///< refused by the kernel
  std::uint64_t kernel_drops = 0;        ///< lost for lack of receive buffer
  std::uint64_t kernel_filtered = 0;     ///< kept away by the socket filter

  // Calls made by this endpoint.
  std::uint64_t calls_started = 0;      ///< by Endpoint::Call
  std::uint64_t calls_completed = 0;    ///< ended by a reply
  std::uint64_t calls_rejected = 0;     ///< ended by a refusal
  std::uint64_t calls_timed_out = 0;    ///< ended by their deadline
  std::uint64_t calls_abandoned = 0;    ///< by Endpoint::Abandon
  std::uint64_t requests_retried = 0;   ///< repeated sends of a request
  std::uint64_t duplicate_replies = 0;  ///< replies to calls already finished

  // Calls served by this endpoint.
  std::uint64_t requests_handled = 0;       ///< handler invocations
  std::uint64_t duplicate_requests = 0;     ///< repeats that did not reach a handler
  std::uint64_t replies_resent = 0;         ///< answered from the cache
  std::uint64_t replies_evicted = 0;        ///< forgotten for lack of cache memory before the caller was done
  std::uint64_t requests_refused_busy = 0;  ///< too many were open
  std::uint64_t requests_challenged = 0;    ///< with a key: of sessions that had to prove themselves first
  std::uint64_t handler_failures = 0;       ///< exceptions that a handler let out

  // Large bodies.
  std::uint64_t objects_sent = 0;      ///< every chunk acknowledged
  std::uint64_t objects_received = 0;  ///< complete, the hash right
  std::uint64_t objects_expired = 0;   ///< given up, incomplete, in either direction
  std::uint64_t chunks_sent = 0;       ///< first transmissions
  std::uint64_t chunks_resent = 0;     ///< after a loss, and as reminders
  std::uint64_t duplicate_chunks = 0;  ///< received once more

  // Rejected datagrams and messages by cause; each datagram is counted at most once.
  std::uint64_t rejected_size = 0;        ///< empty or above the limit
  std::uint64_t rejected_malformed = 0;   ///< not a frame: fingerprint, lengths, trailing bytes
  std::uint64_t rejected_version = 0;     ///< another protocol version
  std::uint64_t rejected_deployment = 0;  ///< foreign deployment
  std::uint64_t rejected_tag = 0;         ///< damaged; with a key also forged
  std::uint64_t rejected_unsigned = 0;    ///< with a key: the tag of a party without one
  std::uint64_t rejected_replay = 0;      ///< with a key: a request or proof seen before, or too old
  std::uint64_t rejected_field = 0;       ///< a field of the frame or chunk out of range
  std::uint64_t rejected_type = 0;        ///< a request that nobody serves
  std::uint64_t rejected_role = 0;        ///< with a key: a request that the role of its key may not make
  std::uint64_t rejected_body = 0;        ///< body undecodable or a message field out of range
  std::uint64_t rejected_object = 0;      ///< hash mismatch, contradictory chunks, above the limit

  /// Sum of the rejected_* above.
  std::uint64_t rejected() const;
  /// Every counter as (name, value), in the order above; names are those of the fields.
  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

}  // namespace legopt::bus
