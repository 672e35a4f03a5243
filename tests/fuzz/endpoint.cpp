// A complete endpoint, serving and calling, with and without a key. Inputs are arbitrary datagrams, and arbitrary
// frames with a valid tag, as a party with the key might send them.
#include "bus/endpoint.h"

#include <array>
#include <memory>
#include <string>

#include "bus/wire.h"
#include "tests/doubles/simulated_network.h"
#include "tests/fuzz/fuzz_input.h"

namespace legopt::bus {
namespace {

constexpr std::int64_t kDeployment = 4711;
constexpr std::size_t kMaxHeld = 256 * 1024;

std::shared_ptr<const MessageKey> Key() {
  std::array<std::uint8_t, MessageKey::kBytes> bytes{};
  return std::make_shared<const MessageKey>(std::span<const std::uint8_t, MessageKey::kBytes>(bytes));
}

class World {
 public:
  explicit World(bool with_key)
      : key_(with_key ? Key() : nullptr),
        transport_(network_, kDeployment, key_),
        endpoint_(transport_, kServer, 1, Options()) {
    network_.SetTap([this](Port, std::span<const std::uint8_t> datagram) {
      FrameView frame;
      const bool ours = OpenFrame(datagram, kDeployment, 1000, frame, key_.get()) == FrameFault::kNone;
      if (!ours) return;
      if (frame.header.sender == kServer && frame.header.kind == FrameKind::kRequest) session_ = frame.header.session;
      if (frame.header.code == static_cast<std::int16_t>(ErrorCode::kProveSession)) {
        challenge_ = ReadChallenge(frame.payload);
      }
    });
    endpoint_.Serve(MessageType::kQuery,
                    [](Request&& request, Responder responder) { responder.Reply(std::move(request.body)); });
    endpoint_.Call(1000, MessageType::kQuery, std::string(5000, 'x'), {}, {});
    endpoint_.Call(1000, MessageType::kQuery, "small", {}, {});
  }

  void Step(fuzz::FuzzInput& input) {
    const auto choice = static_cast<std::uint8_t>(input.Number(1));
    const auto size = static_cast<std::size_t>(input.Number(2)) % (kMaxDatagramBytes + 8);
    const Port port = (choice & 1U) != 0 ? Port::kBulk : Port::kControl;
    if ((choice & 2U) != 0) {
      network_.Inject(port, input.Bytes(size));
    } else {
      Sealed(input, port, std::min(size, kMaxPayloadBytes));
    }
    endpoint_.Poll(microseconds(0));
    network_.Advance(microseconds((choice >> 4U) * 20'000));
    fuzz::Require(endpoint_.held_bytes() <= kMaxHeld + 64 * 1024, "memory stays within the limits");
  }

 private:
  static EndpointOptions Options() {
    EndpointOptions options;
    options.max_object_bytes = 64 * 1024;
    options.max_cached_bytes = kMaxHeld / 2;
    options.max_incoming_bytes = kMaxHeld / 2;
    options.max_open_requests = 8;
    options.max_peers = 4;
    return options;
  }

  void Sealed(fuzz::FuzzInput& input, Port port, std::size_t payload_bytes) {
    FrameHeader header;
    header.version = static_cast<std::int16_t>(kProtocolVersion + (input.Number(1) == 255 ? 1 : 0));
    header.kind = static_cast<FrameKind>(input.Number(1) % 9);
    header.type = static_cast<std::int16_t>(input.Number(1) % 13);
    header.code = static_cast<std::int16_t>(input.Number(1) % 11);
    header.deployment = kDeployment;
    header.sender = input.Number(1) % 2 == 0 ? 1000 : static_cast<EndpointId>(input.Number(1) % 8);
    header.destination = kServer;
    header.session = input.Number(1) % 2 == 0 ? session_ : 7;
    header.call_id = static_cast<std::int64_t>(input.Number(1) % 8);
    header.completed_below = static_cast<std::int64_t>(input.Number(1) % 4);
    header.nonce = static_cast<std::int64_t>(input.Number(2));
    DatagramBuffer buffer{};
    const auto payload = input.Bytes(payload_bytes);
    std::copy(payload.begin(), payload.end(), buffer.begin() + kFrameHeaderBytes);
    std::size_t size = payload.size();
    if (header.kind == FrameKind::kProof && size == 0) {
      WriteChallenge(challenge_, buffer.data() + kFrameHeaderBytes);
      size = kChallengeBytes;
    }
    network_.Inject(port, SealFrame(header, size, buffer, key_.get()));
  }

  std::shared_ptr<const MessageKey> key_;
  SimulatedNetwork network_{1};
  SimulatedTransport transport_;
  Endpoint endpoint_;
  std::int64_t session_ = 7;
  std::int64_t challenge_ = 1;
};

}  // namespace
}  // namespace legopt::bus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  legopt::fuzz::FuzzInput input(data, size);
  legopt::bus::World world(input.Number(1) % 2 == 1);
  while (!input.empty()) world.Step(input);
  return 0;
}
