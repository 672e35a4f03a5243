// Policy: the web server with slow, endless, malformed and remote clients over real sockets. No client may affect
// another one or leave anything behind.
#include "client/serve/http_server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "client/client_error.h"
#include "tests/client/raw_http.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;
using test::Fetch;
using test::RawHttp;

HttpReply Kept(const std::string& text, const std::string& etag) {
  HttpReply reply = TextReply(200, text);
  reply.etag = etag;
  return reply;
}

// "/now" is answered at once, "/later" after Release.
class HttpServerTest : public testing::Test {
 protected:
  void Start(const HttpOptions& options = {}) {
    server_.emplace(
        options,
        [](const HttpRequest& request) -> std::optional<HttpReply> {
          if (request.path == "/now") return Kept("now " + request.experiment, "tag");
          if (request.path == "/large") return TextReply(200, std::string(8 << 20, 'x'));
          if (request.path == "/broken") throw std::runtime_error("planted cause");
          if (request.path != "/later") return TextReply(404, "no");
          return std::nullopt;
        },
        [this](const HttpRequest&) {
          std::unique_lock lock(mutex_);
          ++begun_;
          released_.wait(lock, [this] { return open_; });
          return TextReply(200, "late");
        });
    port_ = test::PortOf(server_->url());
  }
  void TearDown() override { Release(); }
  void Release() {
    {
      const std::lock_guard lock(mutex_);
      open_ = true;
    }
    released_.notify_all();
  }
  bool WaitForStreams(unsigned count) const {
    for (int i = 0; i < 400 && server_->streams() != count; ++i) std::this_thread::sleep_for(milliseconds(50));
    return server_->streams() == count;
  }
  void OpenStreams(unsigned count, int visitor, std::vector<RawHttp>* streams);
  std::string Asked(const std::string& head) const {
    RawHttp http(port_);
    http.Send(head);
    return http.Receive("\r\n\r\n");
  }

  std::mutex mutex_;
  std::condition_variable released_;
  bool open_ = false;
  std::atomic<int> begun_{0};
  std::optional<HttpServer> server_;
  std::uint16_t port_ = 0;
};

TEST_F(HttpServerTest, AnswersWithItsPolicyAndATagThatSavesTheSecondTransfer) {
  Start();
  const std::string answer = Fetch(port_, "/now?experiment=3");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << answer;
  EXPECT_TRUE(answer.ends_with("\r\n\r\nnow 3\n")) << answer;
  EXPECT_NE(answer.find("Content-Security-Policy: default-src 'none'; script-src 'self'"), std::string::npos);
  EXPECT_NE(answer.find("X-Content-Type-Options: nosniff"), std::string::npos);
  EXPECT_EQ(answer.find("Access-Control-Allow-Origin"), std::string::npos);
  const std::string again = Fetch(port_, "/now", "If-None-Match: \"tag\"\r\n");
  EXPECT_TRUE(again.starts_with("HTTP/1.1 304 ")) << again;
  EXPECT_TRUE(again.ends_with("\r\n\r\n")) << again;
  EXPECT_TRUE(Fetch(port_, "/elsewhere").starts_with("HTTP/1.1 404 "));
  EXPECT_NE(Fetch(port_, "/broken").find("planted cause"), std::string::npos);
}

TEST_F(HttpServerTest, AHeadRequestHasNoBody) {
  Start();
  const std::string head = "HEAD /now HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  RawHttp http(port_);
  http.Send(head);
  const std::string answer = http.Receive("");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << answer;
  EXPECT_TRUE(answer.ends_with("\r\n\r\n")) << answer;
}

TEST_F(HttpServerTest, OtherMethodsBodiesAndHostsAreRefused) {
  HttpOptions options;
  options.hosts = {"bench.example"};
  Start(options);
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    const std::string answer = Asked(std::string(method) + " /now HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 405 ")) << method << answer;
    EXPECT_NE(answer.find("Allow: GET, HEAD"), std::string::npos) << answer;
  }
  for (const char* host : {"evil.example", "evil.example:80", "127.0.0.1.evil.example", "[::2]", ""}) {
    EXPECT_TRUE(Asked("GET /now HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n").starts_with("HTTP/1.1 421 "))
        << host;
  }
  for (const char* host : {"127.0.0.1", "LOCALHOST:1", "[::1]:99", "bench.example"}) {
    EXPECT_TRUE(Asked("GET /now HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n").starts_with("HTTP/1.1 200 "))
        << host;
  }
  EXPECT_EQ(Asked("GET /now HTTP/1.0\r\n\r\n").find(" 200 "), std::string::npos);
  RawHttp body(port_);
  body.Send("GET /now HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "10000\r\n" + std::string(0x10000, 'x') + "\r\n";
  int sent = 0;
  while (sent < 1000 && body.Send(chunk)) ++sent;
  EXPECT_LT(sent, 1000) << "64 MB of body were taken";
}

TEST_F(HttpServerTest, AnEndlessHeadIsCutOff) {
  Start();
  RawHttp http(port_);
  http.Send("GET /now HTTP/1.1\r\nHost: localhost\r\nX: ");
  int sent = 0;
  while (sent < 1000 && http.Send(std::string(65536, 'x'))) ++sent;
  EXPECT_LT(sent, 1000);
  EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, WhatTakesTimeHoldsNobodyUp) {
  Start();
  std::vector<RawHttp> waiting;
  for (int i = 0; i < 20; ++i) {
    waiting.emplace_back(port_);
    waiting.back().Get("/later");
  }
  while (begun_ < 2) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 200 "));
  EXPECT_EQ(begun_, 2) << "in two threads, the others wait";
  Release();
  for (RawHttp& http : waiting) EXPECT_NE(http.Receive("late\n").find("late"), std::string::npos);
}

TEST_F(HttpServerTest, AConnectionThatSendsNoWholeRequestIsClosed) {
  HttpOptions options;
  options.limits.head = milliseconds(300);
  Start(options);
  RawHttp silent(port_), slow(port_), answered(port_), body(port_);
  slow.Send("GET /now HT");
  answered.Get("/now");
  body.Send("GET /now HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n");
  EXPECT_NE(answered.Receive("now").find(" 200 "), std::string::npos);
  for (RawHttp* one : {&silent, &slow, &answered, &body}) EXPECT_TRUE(one->Closed());
}

TEST_F(HttpServerTest, ASlowSenderHasFiveSecondsInAll) {
  Start();
  RawHttp slow(port_);
  const auto begin = std::chrono::steady_clock::now();
  slow.Send("GET /now HTTP/1.1\r\n");
  while (slow.Send("X: 1\r\n") && !slow.Closed(milliseconds(500))) {
    ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(4900));
}

TEST_F(HttpServerTest, AnAnswerThatTakesLongerThanARequestMayIsNotCutOff) {
  HttpOptions options;
  options.limits.head = milliseconds(50);
  Start(options);
  RawHttp waiting(port_);
  waiting.Get("/later");
  while (begun_ < 1) std::this_thread::sleep_for(milliseconds(5));
  std::this_thread::sleep_for(milliseconds(600));
  Release();
  EXPECT_NE(waiting.Receive("late\n").find("late"), std::string::npos);
}

TEST_F(HttpServerTest, AReaderThatTakesNothingKeepsOnlyItsConnection) {
  HttpOptions options;
  options.idle_s = 2;
  Start(options);
  RawHttp lazy(port_);
  lazy.Get("/large");
  EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 200 "));
  const std::string all = Fetch(port_, "/large");
  EXPECT_EQ(all.size() - all.find("\r\n\r\n") - 4, (8U << 20U) + 1);
}

TEST_F(HttpServerTest, StreamsGetTheNewestEventAndSignsOfLife) {
  Start();
  server_->Publish(1, "{\"first\":1}");
  RawHttp early(port_);
  early.Get("/events");
  const std::string head = early.Receive("\n\n");
  EXPECT_NE(head.find("Content-Type: text/event-stream"), std::string::npos) << head;
  std::string text = head;
  if (text.find("data:") == std::string::npos) text += early.Receive("}\n\n");
  EXPECT_NE(text.find("id: 1\ndata: {\"first\":1}\n\n"), std::string::npos) << text;
  ASSERT_TRUE(WaitForStreams(1));
  server_->Beat();
  EXPECT_NE(early.Receive(":").find(':'), std::string::npos);
  for (int i = 2; i <= 9; ++i)
    server_->Publish(static_cast<std::uint64_t>(i), "{\"number\":" + std::to_string(i) + "}");
  RawHttp late(port_);
  late.Get("/events");
  const std::string only = late.Receive("}\n\n");
  EXPECT_NE(only.find("id: 9\n"), std::string::npos) << only;
  EXPECT_EQ(only.find("id: 8\n"), std::string::npos) << only;
  EXPECT_NE(early.Receive("id: 9\n").find("id: 9\n"), std::string::npos);
}

// Closed streams without an event or keep-alive count until they are closed.
TEST_F(HttpServerTest, StreamsOfReadersThatWentAreForgotten) {
  Start();
  {
    std::vector<RawHttp> gone;
    for (int i = 0; i < 20; ++i) {
      gone.emplace_back(port_);
      gone.back().Get("/events");
    }
    ASSERT_TRUE(WaitForStreams(20));
  }
  EXPECT_TRUE(WaitForStreams(0));
}

void HttpServerTest::OpenStreams(unsigned count, int visitor, std::vector<RawHttp>* streams) {
  for (unsigned i = 0; i < count; ++i) {
    streams->emplace_back(port_, visitor);
    streams->back().Get("/events");
    ASSERT_TRUE(streams->back().Receive("\r\n\r\n").starts_with("HTTP/1.1 200 ")) << streams->size();
  }
}

TEST_F(HttpServerTest, EachVisitorHas32StreamsAndOthersAreAnsweredBesides) {
  Start();
  std::vector<RawHttp> streams;
  OpenStreams(32, 1, &streams);
  for (int i = 0; i < 100; ++i) {
    const std::string refused = Fetch(port_, "/events");
    ASSERT_TRUE(refused.starts_with("HTTP/1.1 503 ")) << refused;
    ASSERT_NE(refused.find("Retry-After:"), std::string::npos);
  }
  EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 200 ")) << "the same visitor's request";
  EXPECT_TRUE(Fetch(port_, "/now", "", 2).starts_with("HTTP/1.1 200 "));
  OpenStreams(32, 2, &streams);
  streams.erase(streams.begin());
  ASSERT_TRUE(WaitForStreams(63));
  OpenStreams(1, 1, &streams);
}

TEST_F(HttpServerTest, FourHundredStreamsAreServedAndOneMoreIsToldToPoll) {
  Start();
  std::vector<RawHttp> streams;
  for (int visitor = 1; visitor <= 12; ++visitor) OpenStreams(32, visitor, &streams);
  OpenStreams(16, 13, &streams);
  ASSERT_EQ(streams.size(), 400U);
  const std::string refused = Fetch(port_, "/events", "", 14);
  EXPECT_TRUE(refused.starts_with("HTTP/1.1 503 ")) << refused;
  EXPECT_TRUE(Fetch(port_, "/now", "", 14).starts_with("HTTP/1.1 200 "));
  server_->Publish(1, "{}");
  for (RawHttp& stream : streams) EXPECT_NE(stream.Receive("data: {}").find("data: {}"), std::string::npos);
}

TEST_F(HttpServerTest, AConnectionTooManyIsAnsweredWith503) {
  Start();
  std::vector<RawHttp> busy;
  const auto occupy = [&](int visitor, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      busy.emplace_back(port_, visitor);
      busy.back().Get("/later");
    }
  };
  occupy(1, 64);
  while (server_->requests() < busy.size()) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 503 ")) << "the 65th of one visitor";
  EXPECT_TRUE(Fetch(port_, "/now", "", 2).starts_with("HTTP/1.1 200 "));
  for (int visitor = 2; visitor <= 7; ++visitor) occupy(visitor, 64);
  ASSERT_EQ(busy.size(), 448U);
  while (server_->requests() < busy.size() + 2) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(Fetch(port_, "/now", "", 9).starts_with("HTTP/1.1 503 ")) << "the 449th of all";
  busy.pop_back();
  Release();
  for (RawHttp& one : busy) EXPECT_NE(one.Receive("late\n").find("late"), std::string::npos);
  EXPECT_TRUE(Fetch(port_, "/now", "", 9).starts_with("HTTP/1.1 200 "));
}

// A client opens a thousand incomplete requests, from one address or from many.
TEST_F(HttpServerTest, HalfRequestsShutNobodyOut) {
  Start();
  std::vector<RawHttp> half;
  for (int i = 0; i < 1000; ++i) {
    half.emplace_back(port_, i < 600 ? 1 : 1 + i % 20);
    half.back().Send("GET /now HT");
    if (i % 100 != 99) continue;
    EXPECT_TRUE(Fetch(port_, "/now", "", 30).starts_with("HTTP/1.1 200 ")) << i;
    EXPECT_TRUE(Fetch(port_, "/now").starts_with("HTTP/1.1 200 ")) << i << ", the same visitor";
  }
}

TEST_F(HttpServerTest, TheLimitOfOpenFilesLowersTheLimitOfConnections) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const auto child = fork();
  if (child == 0) {
    const rlimit low{110, 110};
    setrlimit(RLIMIT_NOFILE, &low);
    try {
      const HttpServer server({}, {}, {});
    } catch (const ClientError& error) {
      _exit(std::string(error.what()).find("ulimit -n") != std::string::npos ? 0 : 1);
    }
    _exit(2);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(HttpServerTest, EndsWithStreamsAndWaitingRequestsOpen) {
  Start();
  std::vector<RawHttp> readers;
  for (int i = 0; i < 6; ++i) {
    readers.emplace_back(port_);
    readers.back().Get(i % 2 == 0 ? "/events" : "/later");
  }
  ASSERT_TRUE(WaitForStreams(3));
  while (begun_ < 2) std::this_thread::sleep_for(milliseconds(5));
  std::thread opener([this] {
    std::this_thread::sleep_for(milliseconds(100));
    Release();
  });
  server_.reset();
  opener.join();
  for (RawHttp& reader : readers) EXPECT_TRUE(reader.Closed());
}

TEST_F(HttpServerTest, APortInUseAndAnAddressThatIsNoneSayWhatToDo) {
  Start();
  HttpOptions same;
  same.port = port_;
  const auto refusal = [](const HttpOptions& options) -> std::string {
    try {
      const HttpServer server(options, {}, {});
    } catch (const ClientError& error) {
      return std::to_string(StatusOf(error.code())) + " " + error.what();
    }
    return "";
  };
  const std::string used = refusal(same);
  EXPECT_TRUE(used.starts_with("7 http://127.0.0.1:" + std::to_string(port_) + "/")) << used;
  EXPECT_NE(used.find("in use"), std::string::npos) << used;
  EXPECT_NE(used.find("--http-port"), std::string::npos) << used;
  HttpOptions wrong;
  wrong.address = "nowhere";
  EXPECT_TRUE(refusal(wrong).starts_with("2 'nowhere'")) << refusal(wrong);
}

}  // namespace
}  // namespace legopt::client
