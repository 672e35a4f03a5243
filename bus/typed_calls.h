#pragma once

#include <functional>
#include <string>
#include <utility>

#include "bus/codec.h"
#include "bus/endpoint.h"
#include "bus/messages.h"

/// @file
/// Calls with messages instead of bytes: encodes, decodes and validates on both sides, so that handlers and callbacks
/// receive only valid messages. An undecodable request is refused with kMalformed and counted. An undecodable reply
/// ends its call with kRejected, kMalformed.
///
///     ServeMessage<legopt_msg::lease_request>(endpoint,
///         [&](const legopt_msg::lease_request& request, EndpointId sender, ReplyTo<legopt_msg::lease_reply> reply)
///         {...});
///     CallMessage(endpoint, kServer, request, {}, [&](CallOutcome<legopt_msg::lease_reply> outcome) {...});
///
/// Thread rule: see Endpoint.

namespace legopt::bus {

/// Responder for a message. Send() throws BusError (kInvalidMessage) if the message is invalid. If a handler lets this
/// exception out, the call is refused with kHandlerFailed.
template <class Reply>
class ReplyTo {
 public:
  /// Answers through `responder`.
  explicit ReplyTo(Responder responder) : responder_(std::move(responder)) {}
  /// Encodes and replies.
  void Send(Reply message) { responder_.Reply(Encode(std::move(message))); }
  /// See Responder::Reject.
  void Reject(ErrorCode code, std::string_view text) { responder_.Reject(code, text); }

 private:
  Responder responder_;
};

/// Registers handler(const Message&, EndpointId sender, ReplyTo<Reply>) for a call. The handler receives only valid
/// requests.
template <class Message, class Handler>
void ServeMessage(Endpoint& endpoint, Handler handler) {
  using Reply = typename CallOf<Message>::Reply;
  endpoint.Serve(CallOf<Message>::kType, [handler = std::move(handler)](bus::Request&& request, Responder responder) {
    std::string why;
    const auto message = Decode<Message>(request.body, &why);
    if (!message) {
      responder.Reject(ErrorCode::kMalformed, why);
      return;
    }
    handler(*message, request.sender, ReplyTo<Reply>(std::move(responder)));
  });
}

/// CallResult with the decoded reply.
template <class Reply>
struct CallOutcome {
  CallResult::Status status = CallResult::kTimeout;  ///< kRejected also if the reply is invalid
  Reply reply{};                                     ///< set for kOk
  ErrorCode code{};                                  ///< set for kRejected
  std::string error;                                 ///< message for humans if not kOk
  bool ok() const { return status == CallResult::kOk; }
};

/// Makes a call with a message. Throws BusError (kInvalidMessage) if `request` is invalid, and as Endpoint::Call does.
template <class Message>
CallId CallMessage(Endpoint& endpoint, EndpointId to, Message request, const CallOptions& options,
                   std::function<void(CallOutcome<typename CallOf<Message>::Reply>&&)> callback) {
  using Outcome = CallOutcome<typename CallOf<Message>::Reply>;
  return endpoint.Call(to, CallOf<Message>::kType, Encode(std::move(request)), options,
                       [callback = std::move(callback)](CallResult&& result) {
                         Outcome outcome;
                         outcome.status = result.status;
                         outcome.code = result.code;
                         outcome.error = std::move(result.error);
                         if (result.status == CallResult::kOk) {
                           auto reply = Decode<typename CallOf<Message>::Reply>(result.body, &outcome.error);
                           if (reply) {
                             outcome.reply = std::move(*reply);
                           } else {
                             outcome.status = CallResult::kRejected;
                             outcome.code = ErrorCode::kMalformed;
                           }
                         }
                         if (callback) callback(std::move(outcome));
                       });
}

}  // namespace legopt::bus
