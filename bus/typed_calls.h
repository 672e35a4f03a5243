#pragma once

#include <functional>
#include <string>
#include <utility>

#include "bus/codec.h"
#include "bus/endpoint.h"
#include "bus/messages.h"

/// @file
/// Calls in terms of messages rather than bytes: encodes, decodes and checks on both sides, so that neither a handler
/// nor a callback ever sees an illegal message. An undecodable request is refused with kMalformed and counted; an
/// undecodable reply ends its call with kRejected, kMalformed.
///
///     ServeMessage<legopt_msg::lease_request>(endpoint,
///         [&](const legopt_msg::lease_request& request, EndpointId sender, ReplyTo<legopt_msg::lease_reply> reply)
///         {...});
///     CallMessage(endpoint, kServer, request, {}, [&](CallOutcome<legopt_msg::lease_reply> outcome) {...});
///
/// Thread rule: as Endpoint.

namespace legopt::bus {

/// A Responder that takes a message. Send() throws BusError (kInvalidMessage) when the message is illegal; thrown from
/// a handler, that becomes a kHandlerFailed refusal.
template <class Reply>
class ReplyTo {
 public:
  /// Answers through `responder`.
  explicit ReplyTo(Responder responder) : responder_(std::move(responder)) {}
  /// Encodes and replies.
  void Send(Reply message) { responder_.Reply(Encode(std::move(message))); }
  /// As Responder::Reject.
  void Reject(ErrorCode code, std::string_view text) { responder_.Reject(code, text); }

 private:
  Responder responder_;
};

/// Serves the call of a request: handler(const Message&, EndpointId sender, ReplyTo<Reply>), for legal ones only.
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

/// CallResult, the reply decoded.
template <class Reply>
struct CallOutcome {
  CallResult::Status status = CallResult::kTimeout;      ///< kRejected also when the reply is not legal
  Reply reply{};                                         ///< kOk
  ErrorCode code{};                                      ///< kRejected
  std::string error;                                     ///< otherwise
  bool ok() const { return status == CallResult::kOk; }  ///< whether `reply` counts
};

/// Throws BusError (kInvalidMessage) when `request` is illegal, and as Endpoint::Call.
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
