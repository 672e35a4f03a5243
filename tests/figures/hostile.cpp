#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <thread>

#include "bus/lcm_transport.h"
#include "tests/figures/figures.h"
#include "tests/figures/hostile_packets.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kPackets = 1'000'000;
constexpr int kPerSecond = 5'000;
constexpr int kAttackedJobs = 200;

class PacketSender {
 public:
  explicit PacketSender(int port) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, bus::LcmOptions{}.group.c_str(), &address_.sin_addr);
    const unsigned char ttl = 0;
    ip_mreqn loopback{};
    loopback.imr_ifindex = static_cast<int>(::if_nametoindex("lo"));
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback);
  }
  ~PacketSender() { ::close(fd_); }
  PacketSender(const PacketSender&) = delete;
  PacketSender& operator=(const PacketSender&) = delete;
  bool Fire(const std::string& bytes) const {
    return ::sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address_),
                    sizeof address_) == static_cast<ssize_t>(bytes.size());
  }

 private:
  int fd_;
  sockaddr_in address_{};
};

struct SentPackets {
  double took_s = 0;
  std::uint64_t fired = 0;
  std::uint64_t seen = 0;  // number of packets that reach the programs
};

// Sends packets at the rate of figure 14, alternating between control and bulk port.
SentPackets SendAll(int port, std::int64_t deployment, int packets, std::uint64_t seed) {
  constexpr int kPerTick = 10;
  HostilePackets source(deployment, seed);
  const PacketSender control(port);
  const PacketSender bulk(port + 1);
  SentPackets volley;
  const auto begin = Clock::now();
  for (int i = 0; i < packets; ++i) {
    const HostilePacket packet = source.Draw();
    if ((i % 2 == 0 ? control : bulk).Fire(packet.bytes)) {
      ++volley.fired;
      volley.seen += packet.seen ? 1 : 0;
    }
    if (i % kPerTick == 0) {
      std::this_thread::sleep_until(begin + std::chrono::microseconds(std::int64_t{i} * 1'000'000 / kPerSecond));
    }
  }
  volley.took_s = SecondsSince(begin);
  return volley;
}

struct ServerView {
  std::uint64_t rejected = 0;
  std::uint64_t kernel_drops = 0;
};

ServerView ViewOf(Deployment& deployment) {
  ServerView view;
  const nlohmann::json status = deployment.connection().Status(0);
  for (const auto& [name, value] : status.at("server").at("transport").items()) {
    if (name.starts_with("rejected_")) view.rejected += value.get<std::uint64_t>();
    if (name == "kernel_drops") view.kernel_drops = value.get<std::uint64_t>();
  }
  return view;
}

}  // namespace

void MeasureHostility(const Request& request, Findings& findings) {
  findings.Begin("14");
  const int packets = request.count > 0 ? request.count : kPackets;
  const int work_ms = packets / kPerSecond * 1000 / kAttackedJobs;  // on one slot, the jobs last as long as the
                                                                    // packets
  Deployment deployment;
  deployment.StartServer();
  const auto worker = deployment.StartStubWorker({"--slots", "1"});
  const std::int64_t experiment = deployment.Submit(service::StubSpec(kAttackedJobs, work_ms), "under fire");
  deployment.WaitForJobs(experiment, 1);
  bus::LcmOptions network;
  network.port = deployment.port();
  const std::int64_t number = bus::LcmTransport(network).deployment();
  const double before_mb = FactsOf(deployment.server().pid()).resident_mb;
  const double worker_before_mb = FactsOf(worker->pid()).resident_mb;
  const ServerView at_start = ViewOf(deployment);

  const SentPackets volley = SendAll(deployment.port(), number, packets, request.seed);
  const bool done = deployment.WaitFor(
      experiment, [](const nlohmann::json& status) { return status.at("state") == "done"; },
      std::chrono::seconds(120 + packets / kPerSecond));

  findings.Promise(done, "all " + std::to_string(kAttackedJobs) + " jobs done under " + std::to_string(volley.fired) +
                             " packets, " + std::to_string(static_cast<double>(volley.fired) / volley.took_s) +
                             " per second");
  findings.Promise(!deployment.server().Poll() && !worker->Poll(), "server and worker are the same processes");
  findings.Promise(deployment.Query("SELECT sum(attempts - returned) FROM jobs") ==
                       std::vector<std::string>{std::to_string(kAttackedJobs)},
                   "no attempt was wasted");
  const ServerView view = ViewOf(deployment);
  const std::uint64_t rejected = view.rejected - at_start.rejected;
  const std::uint64_t lost = view.kernel_drops - at_start.kernel_drops;
  findings.Promise(rejected <= volley.seen && volley.seen - rejected <= lost,
                   std::to_string(volley.seen) + " of them passed the socket filter, " + std::to_string(rejected) +
                       " were refused and counted by the server, " + std::to_string(lost) +
                       " datagrams were lost in this network namespace for lack of buffer");
  findings.Quantity("memory growth of the server", FactsOf(deployment.server().pid()).resident_mb - before_mb, 20,
                    "MB");
  findings.Quantity("of the worker", FactsOf(worker->pid()).resident_mb - worker_before_mb, 20, "MB");
}

}  // namespace legopt::figures
