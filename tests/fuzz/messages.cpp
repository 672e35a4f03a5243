// Every message decoder: the first byte chooses the message, the rest is its body. What is accepted can be sent again.
#include <array>
#include <string>
#include <tuple>

#include "bus/codec.h"
#include "bus/validate.h"
#include "tests/fuzz/fuzz_input.h"

namespace legopt::bus {
namespace {

using namespace legopt_msg;
using All =
    std::tuple<frame, chunk, chunk_ack, probe_request, probe_reply, hello_request, hello_reply, lease_request,
               lease_reply, method_request, method_reply, heartbeat_request, heartbeat_reply, result_request,
               result_reply, submit_request, submit_reply, status_request, status_reply, query_request, query_reply,
               cancel_request, cancel_reply, shutdown_request, shutdown_reply, control_request, control_reply>;

template <class Message>
void DecodeOne(std::string_view bytes) {
  std::string why;
  const auto message = Decode<Message>(bytes, &why);
  fuzz::Require(message.has_value() || !why.empty(), "a refusal says why");
  if (!message) return;
  const std::string again = Encode(*message);  // throws, and so crashes, when the message is illegal after all
  fuzz::Require(Decode<Message>(again).has_value(), "what is accepted can be sent again");
}

template <std::size_t... index>
void DecodeChosen(std::size_t choice, std::string_view bytes, std::index_sequence<index...> /*all*/) {
  ((choice == index ? DecodeOne<std::tuple_element_t<index, All>>(bytes) : void()), ...);
}

}  // namespace
}  // namespace legopt::bus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using legopt::bus::All;
  legopt::fuzz::FuzzInput input(data, size);
  const auto choice = static_cast<std::size_t>(input.Number(1)) % std::tuple_size_v<All>;
  legopt::bus::DecodeChosen(choice, input.Text(), std::make_index_sequence<std::tuple_size_v<All>>());
  return 0;
}
