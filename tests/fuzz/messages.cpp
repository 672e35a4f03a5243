// Every message decoder: the first byte chooses the message by its index in AllMessages, the rest is its body.
// Accepted messages can be encoded again.
#include <string>

#include "bus/codec.h"
#include "tests/fuzz/fuzz_input.h"

namespace legopt::bus {
namespace {

template <class Message>
void DecodeOne(std::string_view bytes) {
  std::string why;
  const auto message = Decode<Message>(bytes, &why);
  fuzz::Require(message.has_value() || !why.empty(), "a refusal says why");
  if (!message) return;
  const std::string again = Encode(*message);  // throws, and so crashes, if the message is illegal
  fuzz::Require(Decode<Message>(again).has_value(), "what is accepted can be sent again");
}

template <class... Message>
void DecodeChosen(std::size_t choice, std::string_view bytes, MessageList<Message...> /*all*/) {
  ((choice == kMessageIndex<Message> ? DecodeOne<Message>(bytes) : void()), ...);
}

}  // namespace
}  // namespace legopt::bus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using legopt::bus::AllMessages;
  legopt::fuzz::FuzzInput input(data, size);
  const auto choice = static_cast<std::size_t>(input.Number(1)) % AllMessages::kSize;
  legopt::bus::DecodeChosen(choice, input.Text(), AllMessages());
  return 0;
}
