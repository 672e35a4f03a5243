// Parties over the real transport, for tests that depend on the kernel.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"

namespace legopt::bus {

inline constexpr EndpointId kClient = 1000;

// Runs `body` on a separate thread, which may change its network namespace without affecting other tests.
template <class Body>
void OnThread(Body body) {
  std::thread(body).join();
}

struct Host {
  LcmTransport transport;
  Endpoint endpoint;
  Host(const LcmOptions& options, EndpointId id) : transport(options), endpoint(transport, id, RandomSeed()) {}
};

inline bool RunUntil(const std::vector<Endpoint*>& endpoints, const std::function<bool()>& done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!done() && std::chrono::steady_clock::now() < end) {
    for (Endpoint* endpoint : endpoints) endpoint->Poll(std::chrono::milliseconds(1));
  }
  return done();
}

inline void ServeEcho(Host& server) {
  server.endpoint.Serve(MessageType::kProbe,
                        [](Request&& request, Responder responder) { responder.Reply(request.body); });
}

// Returns whether a call reaches an echoing server and the answer returns.
inline bool EchoBetween(Host& client, Host& server) {
  std::string answer;
  client.endpoint.Call(kServer, MessageType::kProbe, "ping", {}, [&](CallResult&& r) { answer = r.body; });
  return RunUntil({&server.endpoint, &client.endpoint}, [&] { return answer == "ping"; });
}

inline bool EchoWorks(const LcmOptions& options) {
  Host server(options, kServer);
  Host client(options, kClient);
  ServeEcho(server);
  return EchoBetween(client, server);
}

inline LcmOptions FreshOptions() {
  LcmOptions options;
  options.port = FindFreePortPair(RandomSeed());
  return options;
}

}  // namespace legopt::bus
