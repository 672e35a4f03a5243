#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "bus/message_key.h"
#include "bus/messages.h"
#include "bus/transport.h"

namespace legopt::bus {

/// @file
/// Reading and writing of big-endian integers in byte buffers, the byte order of LCM and of the bridge. The caller
/// guarantees that the buffer is large enough. Used by bus and bridge.

/// Writes values to a buffer, one after another.
class Writer {
 public:
  /// Starts at `at`.
  explicit Writer(std::uint8_t* at) : at_(at) {}
  /// Writes the sizeof(Integer) bytes of `value`.
  template <class Integer>
  Writer& Put(Integer value) {
    auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t i = sizeof(Integer); i-- > 0;) *at_++ = static_cast<std::uint8_t>(bits >> (8 * i));
    return *this;
  }
  /// Writes bytes unchanged.
  Writer& Bytes(std::span<const std::uint8_t> bytes) {
    at_ = std::copy(bytes.begin(), bytes.end(), at_);
    return *this;
  }
  std::uint8_t* at() const { return at_; }  ///< end of the written bytes

 private:
  std::uint8_t* at_;
};

/// Reads values from a buffer, one after another.
class Reader {
 public:
  /// Starts at `at`.
  explicit Reader(const std::uint8_t* at) : at_(at) {}
  /// Reads sizeof(Integer) bytes.
  template <class Integer>
  Integer Get() {
    std::make_unsigned_t<Integer> bits = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      bits = static_cast<std::make_unsigned_t<Integer>>((std::uint64_t{bits} << 8) | *at_++);
    }
    return static_cast<Integer>(bits);
  }
  /// Reads out.size() bytes unchanged.
  void Bytes(std::span<std::uint8_t> out) {
    std::copy_n(at_, out.size(), out.begin());
    at_ += out.size();
  }

 private:
  const std::uint8_t* at_;
};

// Encoding and decoding of frames, chunks and acknowledgements in place, without allocation. The bytes are the same as
// those of the generated types frame, chunk and chunk_ack (the tests compare them). Used by bus and by programs that
// only listen (`legopt service tap`). Source: PROTOCOL.md, sections 3, 6.

/// Kind of a frame: frame.kind, PROTOCOL.md, section 3.
enum class FrameKind : std::int16_t {
  kRequest = 1,       ///< small body
  kReply = 2,         ///< small body
  kError = 3,         ///< text of a refusal, or a challenge
  kRequestChunk = 4,  ///< piece of a large body
  kReplyChunk = 5,    ///< piece of a large body
  kChunkAck = 6,      ///< acknowledgement of received chunks
  kProof = 7,         ///< proof of a session, with a key
};
/// Largest kind; the kinds are 1 .. kLastFrameKind.
inline constexpr std::int16_t kLastFrameKind = 7;

inline constexpr std::size_t kFrameHeaderBytes = 92;  ///< size of a frame without its payload
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kFrameHeaderBytes;  ///< largest payload
inline constexpr std::size_t kChallengeBytes = 8;     ///< payload of a proof, and of the refusal that requests it
inline constexpr std::size_t kChunkBytes = 1024;      ///< bytes of a body per chunk
inline constexpr std::size_t kChunkHeaderBytes = 57;  ///< size of a chunk without its data
/// Largest distance from the first missing chunk to a chunk that an acknowledgement can report.
inline constexpr std::int32_t kMaxAckDistance = 64;
inline constexpr std::size_t kWindow = 32;           ///< maximum number of chunks in flight to one receiver
inline constexpr std::size_t kObjectHashBytes = 32;  ///< BLAKE2b-256
static_assert(kFrameHeaderBytes + kChunkHeaderBytes + kChunkBytes <= kMaxDatagramBytes);

/// Lets libsodium select the fastest implementation for this machine. Idempotent and thread-safe. Must be called before
/// hashing or using random numbers. Throws BusError (kNetworkUnusable).
void PrepareHashing();

/// Hash that identifies the content of a body.
using ObjectHash = std::array<std::uint8_t, kObjectHashBytes>;
/// Returns BLAKE2b-256 of all bytes. Call PrepareHashing() first.
ObjectHash HashObject(std::span<const std::uint8_t> body);

/// Fields of a frame, named as in frame.lcm, without tag and payload.
struct FrameHeader {
  std::int16_t version = kProtocolVersion;  ///< protocol version
  FrameKind kind{};
  std::int16_t type = 0;              ///< MessageType of the call
  std::int16_t code = 0;              ///< ErrorCode of a refusal; otherwise 0
  std::int64_t deployment = 0;        ///< deployment of the transport
  EndpointId sender = 0;              ///< > 0
  EndpointId destination = 0;         ///< > 0
  std::int64_t session = 0;           ///< session of the caller, > 0
  std::int64_t call_id = 0;           ///< number within the session, from 1
  std::int64_t completed_below = 0;   ///< requests and their chunks: calls with smaller ids are finished; otherwise 0
  std::int64_t nonce = 0;             ///< number of the frame among those of its sender since its start, from 1
  KeyRole role = KeyRole::kOperator;  ///< role of the key that made the tag; not a field of the frame
};

/// Decoded frame that refers to its datagram.
struct FrameView {
  FrameHeader header;
  std::span<const std::uint8_t> payload;  ///< part of the datagram
  bool authentic = false;                 ///< the tag is valid under the key or, without a key, as a checksum
};

/// Reason for rejecting a frame.
enum class FrameFault {
  kNone,        ///< accepted
  kSize,        ///< empty or larger than a datagram
  kMalformed,   ///< not a frame: wrong fingerprint or lengths
  kDeployment,  ///< another deployment
  kNotForUs,    ///< addressed to another party; not an error
  kTag,         ///< damaged or forged, or made with a key that cannot be derived from `key`
  kUnsigned,    ///< tagged by a party without a key
  kField,       ///< field out of range
  kVersion      ///< another protocol version
};

/// Buffer for any datagram.
using DatagramBuffer = std::array<std::uint8_t, kMaxDatagramBytes>;

/// Writes the header of a frame before the payload at buffer[kFrameHeaderBytes ...] and returns the whole datagram.
/// `payload_bytes` must be at most kMaxPayloadBytes. With a key, the tag is made with the key of header.role, which
/// must be `key` or derived from it. Aborts otherwise.
std::span<const std::uint8_t> SealFrame(const FrameHeader& header, std::size_t payload_bytes, DatagramBuffer& buffer,
                                        const MessageKey* key = nullptr);

inline constexpr EndpointId kAnyDestination = 0;  ///< value of `self` that accepts frames for every party

/// Decodes a frame in `datagram` and checks it in this order: size, form, deployment, destination, tag, fields,
/// version. Sets the header's role to that of the key that made the tag: `key` or one derived from it. kUnsigned means
/// that the sender does not have that key. For kUnsigned and kVersion the header is valid, so that an error reply is
/// possible. It is filled in for all results except kSize and kMalformed.
FrameFault OpenFrame(std::span<const std::uint8_t> datagram, std::int64_t deployment, EndpointId self, FrameView& frame,
                     const MessageKey* key = nullptr);

/// Writes a challenge as the payload of a frame.
void WriteChallenge(std::int64_t challenge, std::uint8_t* payload);
/// Returns the challenge; 0 if the payload is not exactly one positive number.
std::int64_t ReadChallenge(std::span<const std::uint8_t> payload);

/// Decoded chunk that refers to its datagram: PROTOCOL.md, section 6.
struct ChunkView {
  std::int64_t total_bytes = 0;        ///< size of the whole body
  ObjectHash hash{};                   ///< hash of the whole body
  std::int32_t index = 0;              ///< index among the chunks, from 0
  bool ack_requested = false;          ///< the receiver must acknowledge immediately
  std::span<const std::uint8_t> data;  ///< part of the datagram; every chunk except the last is full
};

/// Returns the number of chunks of a body.
inline std::size_t NumChunks(std::size_t body_bytes) { return (body_bytes + kChunkBytes - 1) / kChunkBytes; }

/// Writes `chunk` to `payload` (kChunkHeaderBytes + data bytes) and returns the number of bytes written.
std::size_t WriteChunk(const ChunkView& chunk, std::uint8_t* payload);
/// Decodes a chunk. Returns false if the payload is not exactly one chunk, its index or size does not fit total_bytes,
/// or total_bytes is greater than `max_object_bytes`.
bool ReadChunk(std::span<const std::uint8_t> payload, std::size_t max_object_bytes, ChunkView& chunk);

/// Acknowledgement of the received chunks of a body: PROTOCOL.md, section 6. The fields are those of chunk_ack.lcm.
struct ChunkAck {
  bool of_reply = false;            ///< true: body of the reply; false: body of the request
  bool complete = false;            ///< the whole body was received and verified
  std::int64_t reassembly = 0;      ///< number of this attempt to receive the body
  std::int32_t received_below = 0;  ///< all chunks with a smaller index were received
  std::uint64_t received_mask = 0;  ///< bit i: chunk received_below + 1 + i was received
  std::int32_t credit = 1;          ///< maximum number of chunks in flight to this party, 1 .. kWindow
};
/// Writes `ack` to `payload` (34 bytes) and returns the number of bytes written.
std::size_t WriteAck(const ChunkAck& ack, std::uint8_t* payload);
/// Decodes an acknowledgement. Returns false if the payload is not exactly one acknowledgement with its fields in
/// range.
bool ReadAck(std::span<const std::uint8_t> payload, ChunkAck& ack);

}  // namespace legopt::bus
