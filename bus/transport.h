#pragma once

#include <poll.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

/// @file
/// Layer 1 of the bus: unreliable datagrams of at most 1,200 bytes on two ports, a clock, and one place to wait.
///
/// A transport may lose, repeat, reorder and delay datagrams without reporting it; Endpoint (endpoint.h) implements
/// calls on top. Every party of a deployment receives all datagrams on its ports, including its own.
///
/// Thread rule: one thread uses a transport.

/// Datagrams, calls with retry, and acknowledged chunks (lcmtypes/PROTOCOL.md).
namespace legopt::bus {

class MessageKey;

using std::chrono::microseconds;

/// Address of a party. Positive; all parties except the server choose 63 random bits.
using EndpointId = std::int64_t;
inline constexpr EndpointId kServer = 1;           ///< role address of the deployment's server
inline constexpr EndpointId kServerCandidate = 2;  ///< role address of servers that are starting

/// Largest datagram that a transport takes, in bytes of encoded frame (PROTOCOL.md, section 3).
inline constexpr std::size_t kMaxDatagramBytes = 1200;

/// Port of a deployment.
enum class Port : std::uint8_t {
  kControl,  ///< requests and replies that fit in one datagram
  kBulk,     ///< chunks of large bodies, and their acknowledgements
};

/// Receiver of a transport's datagrams. Called only from within Transport::Poll, on its thread.
class DatagramReceiver {
 public:
  /// Processes a datagram, which is valid only during the call. Must not throw: the caller may be a C function.
  virtual void OnDatagram(Port port, std::span<const std::uint8_t> datagram) noexcept = 0;

 protected:
  ~DatagramReceiver() = default;
};

/// Counters that only the transport can provide, counted since construction.
struct TransportCounters {
  std::uint64_t datagrams_sent = 0;      ///< datagrams on both ports, including send_failures
  std::uint64_t datagrams_received = 0;  ///< datagrams that reached the receiver
  std::uint64_t bytes_sent = 0;          ///< bytes in datagrams_sent
  std::uint64_t bytes_received = 0;      ///< bytes in datagrams_received
  std::uint64_t send_failures = 0;       ///< refused by the kernel, e.g. because of a full buffer
  std::uint64_t kernel_drops = 0;        ///< lost because the receive buffer was full, see LcmTransport
  std::uint64_t kernel_filtered = 0;     ///< dropped by the socket filter: for other parties or of other programs
};

/// Connection of one party to the network. Guarantees: transport.h.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// Sends one datagram to all parties on `port`. Aborts if it is larger than kMaxDatagramBytes (broken invariant).
  /// Never blocks for long, never reports loss.
  virtual void Send(Port port, std::span<const std::uint8_t> datagram) = 0;

  /// Sets the receiver of all further datagrams; null stops delivery. `self` is a hint that lets the transport drop
  /// datagrams for other parties early; the receiver still checks the destination. `receiver` must outlive the
  /// transport or be detached.
  virtual void SetReceiver(DatagramReceiver* receiver, EndpointId self) = 0;

  /// Waits until a datagram arrives, an `extra` descriptor is ready (sets revents), or `max_wait` has passed, and
  /// delivers the received datagrams (a limited number, so that timers are not starved). Does not wait if `max_wait` is
  /// zero or negative. Returns the number of datagrams delivered. EINTR ends the wait early. Must not be called from a
  /// receiver.
  virtual int Poll(std::span<pollfd> extra, microseconds max_wait) = 0;

  /// Steady time since an arbitrary start.
  virtual microseconds now() const = 0;

  /// Number of the deployment to which this transport belongs. Every frame contains it, so that other deployments'
  /// traffic is recognised.
  virtual std::int64_t deployment() const = 0;

  /// Shared key of the deployment, used to make and check tags; null without a key. Valid as long as the transport.
  virtual const MessageKey* key() const { return nullptr; }

  virtual TransportCounters counters() const = 0;
};

}  // namespace legopt::bus
