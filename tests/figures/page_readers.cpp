#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/raw_http.h"
#include "tests/figures/figures.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using test::RawHttp;

constexpr int kStreams = 200;
constexpr int kStreamsOfVisitor = 25;
constexpr int kHostileVisitor = 100;
constexpr int kRequests = 20'000;
constexpr int kJobs = 200;
constexpr int kWork_ms = 50;
constexpr int kSlowReaders = 100;
constexpr double kMaxGrowth_mb = 32;
constexpr double kServerGrowth_mb = 8;
constexpr double kAnswer_ms = 100;

// Returns the bytes of a misbehaving client, whose connection stays open.
std::string MisbehavingRequest(int kind) {
  const std::string host = "Host: localhost\r\n";
  switch (kind) {
    case 0:
      return "GET /sta";  // incomplete
    case 1:
      return "GET /page.js HTTP/1.1\r\n" + host + "\r\n";  // never reads the answer
    case 2:
      return "GET / HTTP/1.1\r\n" + host + "X: " + std::string(1 << 20, 'x');  // endless line
    case 3:
      return "GET / HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\nFFFFFFF\r\n" + std::string(1 << 20, 'x');
    case 4:
      return "POST / HTTP/1.1\r\n" + host + "Content-Length: 9999999999\r\n\r\n" + std::string(1 << 20, 'x');
    case 5:
      return std::string("\0\xff\r\n\r\nGET\r\n\r\n", 13);
    default:
      return "GET /blocks/page?experiment=" + std::string(9000, '9') + " HTTP/1.1\r\n" + host + "\r\n";
  }
}

struct Answers {
  std::vector<double> took_ms;
  int wrong = 0;
};

Answers AskMany(std::uint16_t port, int count) {
  constexpr std::array<const char*, 4> kPaths = {"/", "/state", "/blocks/nothing", "/page.js"};
  Answers answers;
  for (int i = 0; i < count; ++i) {
    const auto begin = Clock::now();
    const std::string path = kPaths[static_cast<std::size_t>(i) % kPaths.size()];
    const std::string expected = path == "/blocks/nothing" ? "HTTP/1.1 404 " : "HTTP/1.1 200 ";
    if (!test::Fetch(port, path).starts_with(expected)) ++answers.wrong;
    answers.took_ms.push_back(1e3 * SecondsSince(begin));
  }
  return answers;
}

}  // namespace

void MeasurePageReaders(const Request& request, Findings& findings) {
  findings.Begin("28");
  const int requests = request.count > 0 ? request.count : kRequests;
  Deployment deployment;
  deployment.StartServer();
  const auto worker = deployment.StartStubWorker({"--slots", "1"});
  const std::int64_t experiment = deployment.Submit(service::StubSpec(kJobs, kWork_ms), "looked at");
  const std::uint16_t port = test::FreePort();
  client::ChildProcess serve(
      service::Program("legopt"),
      {"serve", "--port", std::to_string(deployment.port()), "--http-port", std::to_string(port)}, true);
  if (!serve.WaitForLine("http://", std::chrono::seconds(60))) {
    findings.Promise(false, "legopt serve begins: " + serve.ErrorTail());
    return;
  }

  std::vector<RawHttp> streams;
  for (int i = 0; i < kStreams; ++i) {
    streams.emplace_back(port, 2 + i / kStreamsOfVisitor);
    streams.back().Get("/events");
  }
  test::Fetch(port, "/page.js");
  const double before_mb = FactsOf(serve.pid()).resident_mb;
  const double server_before_mb = FactsOf(deployment.server().pid()).resident_mb;

  std::vector<RawHttp> hostile;
  for (int i = 0; i < kSlowReaders; ++i) {
    hostile.emplace_back(port, kHostileVisitor);
    hostile.back().Send(MisbehavingRequest(i % 7));
  }
  const Answers answers = AskMany(port, requests);
  const double after_mb = FactsOf(serve.pid()).resident_mb;

  findings.Promise(answers.wrong == 0, std::to_string(requests) + " requests beside " + std::to_string(kStreams) +
                                           " streams and " + std::to_string(kSlowReaders) +
                                           " slow, endless and malformed ones are all answered");
  findings.Promise(deployment.WaitUntilDone(experiment), "all " + std::to_string(kJobs) + " jobs are done");
  int informed = 0;
  const std::string last = "\"done\":" + std::to_string(kJobs);
  for (RawHttp& stream : streams) informed += stream.Receive(last).find(last) != std::string::npos ? 1 : 0;
  findings.Promise(informed == kStreams,
                   std::to_string(informed) + " of " + std::to_string(kStreams) + " streams told that all is done");
  findings.Promise(!serve.Poll() && !deployment.server().Poll(), "server and `legopt serve` are the same processes");
  findings.Quantity("an answer, 99 of 100", Quantile(answers.took_ms, 0.99), kAnswer_ms, "ms");
  findings.Quantity("memory growth of `legopt serve`", after_mb - before_mb, kMaxGrowth_mb, "MB");
  findings.Quantity("of the server", FactsOf(deployment.server().pid()).resident_mb - server_before_mb,
                    kServerGrowth_mb, "MB");
}

}  // namespace legopt::figures
