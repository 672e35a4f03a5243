#pragma once

#include <poll.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

/// @file
/// Layer 1 of the bus: unreliable datagrams of at most 1,200 bytes on two ports, a clock, and one place to wait.
///
/// A transport may lose, repeat, reorder and delay datagrams and says nothing about it; Endpoint (endpoint.h) makes
/// calls out of them. Every party of a deployment hears everything on its ports, its own datagrams included.
///
/// Thread rule: one thread uses a transport.

/// Datagrams, calls with retry, acknowledged chunks (lcmtypes/PROTOCOL.md).
namespace legopt::bus {

class MessageKey;

using std::chrono::microseconds;

/// Address of one party. Positive; chosen at random (63 bits) by everybody but the server.
using EndpointId = std::int64_t;
inline constexpr EndpointId kServer = 1;           ///< role address of the deployment's server
inline constexpr EndpointId kServerCandidate = 2;  ///< of all servers that are about to start

/// Largest datagram that a transport takes, in bytes of encoded frame (PROTOCOL.md, section 3).
inline constexpr std::size_t kMaxDatagramBytes = 1200;

/// Which of the two ports.
enum class Port : std::uint8_t {
  kControl,  ///< requests, replies: everything that fits one datagram
  kBulk,     ///< chunks of large bodies and their acknowledgements
};

/// Who gets the datagrams of a transport. Called only from within Transport::Poll, on its thread.
class DatagramReceiver {
 public:
  /// `datagram` is valid during the call only. Must not throw: the caller may be a C frame.
  virtual void OnDatagram(Port port, std::span<const std::uint8_t> datagram) noexcept = 0;

 protected:
  ~DatagramReceiver() = default;
};

/// What only the transport can know. Counts since construction.
struct TransportCounters {
  std::uint64_t datagrams_sent = 0;      ///< on both ports, send_failures included
  std::uint64_t datagrams_received = 0;  ///< that reached the receiver
  std::uint64_t bytes_sent = 0;          ///< of datagrams_sent
  std::uint64_t bytes_received = 0;      ///< of datagrams_received
  std::uint64_t send_failures = 0;       ///< the kernel refused a datagram, e.g. no buffer space
  std::uint64_t kernel_drops = 0;        ///< lost for lack of receive buffer, see LcmTransport
  std::uint64_t kernel_filtered = 0;     ///< kept away by the socket filter: addressed to others, or not ours at all
};

/// One party's end of the network; transport.h says what it promises.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// Sends one datagram to everybody on `port`. Aborts when it is larger than kMaxDatagramBytes (broken invariant).
  /// Never blocks for long, never reports loss.
  virtual void Send(Port port, std::span<const std::uint8_t> datagram) = 0;

  /// Delivers to `receiver` from now on; null stops. `self` lets the transport keep datagrams for others away early;
  /// that is a hint, and the receiver still checks the destination. `receiver` must outlive the transport or be
  /// detached.
  virtual void SetReceiver(DatagramReceiver* receiver, EndpointId self) = 0;

  /// Waits until a datagram arrives, an `extra` descriptor is ready (revents is filled in), or `max_wait` has passed,
  /// and delivers what has arrived (bounded, so that timers are not starved). Zero does not wait; negative is zero.
  /// Returns the number of datagrams delivered. EINTR returns early. Not to be called from a receiver.
  virtual int Poll(std::span<pollfd> extra, microseconds max_wait) = 0;

  /// Steady time since an arbitrary start.
  virtual microseconds now() const = 0;

  /// Which deployment this transport belongs to; stands in every frame, so that foreign traffic is recognised.
  virtual std::int64_t deployment() const = 0;

  /// The deployment's shared key, by which frames are tagged and checked; null without one. Lives as long as the
  /// transport.
  virtual const MessageKey* key() const { return nullptr; }

  virtual TransportCounters counters() const = 0;  ///< as of now
};

}  // namespace legopt::bus
