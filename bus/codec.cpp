#include "bus/codec.h"

#include <array>
#include <cstdint>
#include <exception>

#include "bus/message_validation.h"

namespace legopt::bus::codec_internal {
namespace {

constexpr std::size_t kFingerprintBytes = 8;

// Coding functions of one message type. The generated types have no common base: `message` points to an object of the
// type.
struct Coder {
  const char* (*name)();
  std::int64_t (*fingerprint)();
  std::string_view layout;
  void (*put_right)(void* message);
  std::string (*fault)(const void* message);
  int (*encoded_size)(const void* message);
  int (*encode)(const void* message, std::string& bytes);  // bytes written; negative: failed
  int (*decode)(void* message, std::string_view bytes);    // bytes consumed; negative: failed
};

template <class Message>
constexpr Coder CoderOf() {
  return {.name = &Message::getTypeName,
          .fingerprint = &Message::getHash,
          .layout = kLayout<Message>,
          .put_right = [](void* message) { fields::Sanitize(*static_cast<Message*>(message)); },
          .fault = [](const void* message) { return fields::FaultOf(*static_cast<const Message*>(message)); },
          .encoded_size = [](const void* message) { return static_cast<const Message*>(message)->getEncodedSize(); },
          .encode =
              [](const void* message, std::string& bytes) {
                return static_cast<const Message*>(message)->encode(bytes.data(), 0, static_cast<int>(bytes.size()));
              },
          .decode =
              [](void* message, std::string_view bytes) {
                return static_cast<Message*>(message)->decode(bytes.data(), 0, static_cast<int>(bytes.size()));
              }};
}

template <class... Message>
constexpr std::array<Coder, sizeof...(Message)> CodersOf(MessageList<Message...> /*all*/) {
  return {CoderOf<Message>()...};
}

constexpr std::array kCoders = CodersOf(AllMessages());

std::uint64_t FingerprintOf(std::string_view bytes) {
  std::uint64_t fingerprint = 0;
  for (const char byte : bytes.substr(0, kFingerprintBytes)) {
    fingerprint = (fingerprint << 8) | static_cast<std::uint8_t>(byte);
  }
  return fingerprint;
}

// Returns the fault of the encoded bytes before decoding; empty if there is none.
std::string FaultOfBytes(const Coder& coder, std::string_view bytes) {
  if (bytes.size() < kFingerprintBytes) return "shorter than a fingerprint";
  if (bytes.size() > kMaxMessageBytes) return "above " + std::to_string(kMaxMessageBytes) + " bytes";
  if (FingerprintOf(bytes) != static_cast<std::uint64_t>(coder.fingerprint())) {
    return "another message type or revision";
  }
  if (!LayoutFits(coder.layout, bytes.substr(kFingerprintBytes))) {
    return "truncated, followed by something, or with an illegal length";
  }
  return {};
}

// Decodes into `message`. Returns its fault; empty if there is none.
std::string DecodeChecked(const Coder& coder, std::string_view bytes, void* message) {
  if (std::string fault = FaultOfBytes(coder, bytes); !fault.empty()) return fault;
  try {
    const int consumed = coder.decode(message, bytes);
    if (consumed < 0 || static_cast<std::size_t>(consumed) != bytes.size()) return "undecodable";
    return coder.fault(message);
  } catch (const std::exception&) {
    return "undecodable";
  }
}

}  // namespace

std::string FaultOf(std::size_t message_index, const void* message) { return kCoders.at(message_index).fault(message); }

std::string Encode(std::size_t message_index, void* message) {
  const Coder& coder = kCoders.at(message_index);
  const auto refuse = [&coder](const std::string& fault) {
    throw BusError(BusErrorCode::kInvalidMessage, std::string(coder.name()) + ": " + fault);
  };
  coder.put_right(message);
  if (const std::string fault = coder.fault(message); !fault.empty()) refuse(fault);
  const auto size = static_cast<std::size_t>(coder.encoded_size(message));
  std::string bytes(size, '\0');
  if (size > kMaxMessageBytes || coder.encode(message, bytes) < 0) {
    refuse("too large to encode (" + std::to_string(size) + " bytes)");
  }
  return bytes;
}

bool Decode(std::size_t message_index, std::string_view bytes, void* message, std::string* why) {
  const Coder& coder = kCoders.at(message_index);
  const std::string fault = DecodeChecked(coder, bytes, message);
  if (!fault.empty() && why != nullptr) *why = std::string(coder.name()) + ": " + fault;
  return fault.empty();
}

}  // namespace legopt::bus::codec_internal
