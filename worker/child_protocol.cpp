#include "worker/child_protocol.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "bus/codec.h"
#include "legopt_msg/hello_request.hpp"

namespace legopt::worker {
namespace {

constexpr std::uint32_t kMagic = 0x4c474a31;  // "LGJ1"
constexpr std::size_t kTypeOffset = 4;
constexpr std::size_t kSequenceOffset = 8;
constexpr std::size_t kLengthOffset = 16;
constexpr std::size_t kHashOffset = 24;
// Consumed frames are removed from the buffer only above this size.
constexpr std::size_t kCompactBytes = 1U << 16;

template <class T>
void Put(std::string& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

template <class T>
T Get(std::string_view bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Protects against accidents, not attacks: a malicious job process can write valid frames itself.
std::uint64_t FrameHash(std::string_view header, std::string_view body) {
  static constexpr std::array<unsigned char, crypto_shorthash_KEYBYTES> kKey = {'l', 'e', 'g', 'o', 'p', 't', ' ', 'j',
                                                                                'o', 'b', ' ', 'f', 'r', 'a', 'm', 'e'};
  const auto hash = [](std::string_view bytes) {
    std::array<unsigned char, crypto_shorthash_BYTES> out{};
    crypto_shorthash(out.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), kKey.data());
    std::uint64_t value = 0;
    std::memcpy(&value, out.data(), sizeof value);
    return value;
  };
  std::string covered(header.substr(kTypeOffset, kHashOffset - kTypeOffset));
  const std::uint64_t body_hash = hash(body);
  covered.append(reinterpret_cast<const char*>(&body_hash), sizeof body_hash);
  return hash(covered);
}

bool KnownType(std::uint32_t type) {
  return type >= static_cast<std::uint32_t>(FrameType::kJob) && type <= static_cast<std::uint32_t>(FrameType::kResult);
}

}  // namespace

std::string EncodeFrame(const Frame& frame) {
  std::string bytes(kFrameHeaderBytes, '\0');
  Put(bytes, 0, kMagic);
  Put(bytes, kTypeOffset, static_cast<std::uint32_t>(frame.type));
  Put(bytes, kSequenceOffset, frame.sequence);
  Put(bytes, kLengthOffset, static_cast<std::uint64_t>(frame.body.size()));
  Put(bytes, kHashOffset, FrameHash(bytes, frame.body));
  return bytes + frame.body;
}

FrameReader::Status FrameReader::Next(Frame* frame, std::string* why) {
  const auto garbage = [&](const char* text) {
    broken_ = true;
    *why = text;
    return Status::kGarbage;
  };
  if (broken_) return garbage("unreadable since an earlier frame");
  const std::string_view rest = std::string_view(buffer_).substr(consumed_);
  // Checks the first bytes of the magic, because a process that writes garbage may never send a whole header.
  const std::size_t magic_bytes = std::min(rest.size(), sizeof kMagic);
  if (std::memcmp(rest.data(), &kMagic, magic_bytes) != 0) return garbage("bytes that begin no frame");
  if (rest.size() < kFrameHeaderBytes) return Status::kNeedMore;
  const auto type = Get<std::uint32_t>(rest, kTypeOffset);
  const auto length = Get<std::uint64_t>(rest, kLengthOffset);
  if (!KnownType(type)) return garbage("a frame of unknown type");
  if (length > kMaxFrameBytes) return garbage("a frame that claims to be too long");
  if (rest.size() - kFrameHeaderBytes < length) return Status::kNeedMore;
  const std::string_view body = rest.substr(kFrameHeaderBytes, length);
  if (FrameHash(rest.substr(0, kFrameHeaderBytes), body) != Get<std::uint64_t>(rest, kHashOffset)) {
    return garbage("a damaged frame");
  }
  frame->type = static_cast<FrameType>(type);
  frame->sequence = Get<std::uint64_t>(rest, kSequenceOffset);
  frame->body = body;
  consumed_ += kFrameHeaderBytes + length;
  if (consumed_ == buffer_.size() || consumed_ > kCompactBytes) {
    buffer_.erase(0, consumed_);
    consumed_ = 0;
  }
  return Status::kFrame;
}

std::string EncodeJob(const legopt_msg::lease& lease, std::string_view options_json) {
  const std::string encoded = bus::Encode(lease);
  const auto length = static_cast<std::uint32_t>(encoded.size());
  std::string body(sizeof length, '\0');
  Put(body, 0, length);
  body += encoded;
  body += options_json;
  return body;
}

bool DecodeJob(std::string_view body, legopt_msg::lease* lease, std::string* options_json) {
  std::uint32_t length = 0;
  if (body.size() < sizeof length) return false;
  length = Get<std::uint32_t>(body, 0);
  body.remove_prefix(sizeof length);
  if (length > body.size()) return false;
  std::optional<legopt_msg::lease> decoded = bus::Decode<legopt_msg::lease>(body.substr(0, length));
  if (!decoded) return false;
  *lease = std::move(*decoded);
  *options_json = body.substr(length);
  return true;
}

// Encodes a hello_request of which only the capabilities are used: its decoder checks names and hashes.
std::string EncodeCapabilities(const std::vector<Capability>& capabilities) {
  legopt_msg::hello_request message{};
  message.protocol_version = bus::kProtocolVersion;
  message.build_id = "child";
  message.processors = 1;
  message.worker_name = "job process";
  message.pid = 1;
  message.slots = 1;
  for (const Capability& capability : capabilities) message.capabilities.push_back(ToMessage(capability));
  return bus::Encode(std::move(message));
}

bool DecodeCapabilities(std::string_view body, std::vector<Capability>* capabilities) {
  const std::optional<legopt_msg::hello_request> message = bus::Decode<legopt_msg::hello_request>(body);
  if (!message) return false;
  capabilities->clear();
  for (const legopt_msg::capability& capability : message->capabilities) {
    const auto kind = ParseEnum<CapabilityKind>(capability.kind);
    if (!kind) return false;
    capabilities->push_back({capability.name, capability.hash, *kind});
  }
  return true;
}

legopt_msg::capability ToMessage(const Capability& capability) {
  legopt_msg::capability message{};
  message.kind = ToString(capability.kind);
  message.name = capability.name;
  message.hash = capability.hash;
  return message;
}

std::string EncodeProgress(int done, int total) {
  std::string body(2 * sizeof(std::int32_t), '\0');
  Put(body, 0, static_cast<std::int32_t>(done));
  Put(body, sizeof(std::int32_t), static_cast<std::int32_t>(total));
  return body;
}

bool DecodeProgress(std::string_view body, int* done, int* total) {
  if (body.size() != 2 * sizeof(std::int32_t)) return false;
  *done = Get<std::int32_t>(body, 0);
  *total = Get<std::int32_t>(body, sizeof(std::int32_t));
  return true;
}

}  // namespace legopt::worker
