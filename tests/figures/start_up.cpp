#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "app/exit_codes.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/service/child_process.h"
#include "tests/figures/figures.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

using app::ExitCode;
using client::ChildProcess;
using std::chrono::seconds;

constexpr char kUnshare[] = "/usr/bin/unshare";
constexpr char kOwnNetwork[] = "-n";
constexpr char kOwnUser[] = "-Urn";
constexpr double kLimit_s = 1;
constexpr std::chrono::milliseconds kStartPatience = seconds(30);

// A program that cannot start: its name, its command, and the expected message.
struct Case {
  std::string name;
  std::vector<std::string> command;
  ExitCode code;
  std::string words;
};

// Returns whether unshare(1) is permitted here.
bool Unshares(const std::string& options) {
  if (::access(kUnshare, X_OK) != 0) return false;
  ChildProcess probe(kUnshare, {options, "true"}, true);
  const auto exit = probe.Wait(kStartPatience);
  return exit && exit->signal == 0 && exit->code == 0;
}

void MeasureRefusal(const Case& refused, Findings& findings) {
  const auto begin = Clock::now();
  ChildProcess program(refused.command.front(), {refused.command.begin() + 1, refused.command.end()}, true);
  const auto exit = program.Wait(kStartPatience);
  const double took_s = SecondsSince(begin);
  const bool right = exit && exit->signal == 0 && exit->code == static_cast<int>(refused.code);
  const bool named = program.ErrorTail().find(refused.words) != std::string::npos;
  findings.Promise(right && named, refused.name + ": " + (exit ? exit->Describe() : "still running") +
                                       (named ? "" : ", without \"" + refused.words + "\": " + program.ErrorTail()));
  findings.Quantity(refused.name + " takes", took_s, kLimit_s, "s");
}

// Holds a UDP port exclusively.
class ExclusivePort {
 public:
  explicit ExclusivePort(int port) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("port " + std::to_string(port) + " cannot be held");
    }
  }
  ~ExclusivePort() { ::close(fd_); }
  ExclusivePort(const ExclusivePort&) = delete;
  ExclusivePort& operator=(const ExclusivePort&) = delete;

 private:
  int fd_;
};

bool KernelGrantsLess() {
  std::size_t most = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> most;
  return most < bus::LcmOptions().receive_buffer_bytes;
}

// Starts the server in a new user namespace without the privilege to exceed net.core.rmem_max, so that its receive
// buffer may be smaller than requested.
void MeasureSmallBuffer(const std::string& server, const std::string& database, Findings& findings) {
  const std::string script =
      "ip link set lo up && ip route add 239.255.76.67/32 dev lo && exec " + server + " --db " + database;
  ChildProcess program(kUnshare, {kOwnUser, "sh", "-c", script}, true);
  const auto begin = Clock::now();
  const bool ready = program.WaitForLine("ready", kStartPatience);
  const double took_s = SecondsSince(begin);
  program.Stop(seconds(5));
  const bool warned = program.ErrorTail().find("receive buffer of") != std::string::npos;
  if (!ready) {
    findings.Note("small receive buffer: not measured: " + program.ErrorTail());
  } else {
    findings.Promise(warned == KernelGrantsLess(), std::string("receive buffer in a namespace without privileges ") +
                                                       (KernelGrantsLess() ? "smaller than asked, " : "as asked, ") +
                                                       (warned ? "said in a warning" : "nothing said of it") +
                                                       ", ready after " + std::to_string(took_s) + " s");
  }
}

}  // namespace

void MeasureStartUp(const Request& /*request*/, Findings& findings) {
  findings.Begin("25");
  service::Deployment deployment;
  deployment.StartServer();
  const std::string server = service::Program("legopt-server").string();
  const std::string worker = service::Program("legopt-worker").string();
  const std::string client = service::Program("legopt").string();
  const std::string fresh = (deployment.folder() / "fresh.sqlite").string();
  const std::string taken = std::to_string(deployment.port());
  const int held = bus::FindFreePortPair(bus::RandomSeed());
  const ExclusivePort squatter(held);
  const std::string free = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
  const std::string port = std::to_string(held);
  std::vector<Case> cases = {
      {"server on the ports of another",
       {server, "--db", fresh, "--port", taken},
       ExitCode::kNetworkUnusable,
       "--port"},
      {"server on a port held by a stranger",
       {server, "--db", fresh, "--port", port},
       ExitCode::kNetworkUnusable,
       port},
      {"client on a port held by a stranger", {client, "status", "--port", port}, ExitCode::kNetworkUnusable, port},
      {"server with a database in use",
       {server, "--db", deployment.database().string(), "--port", free},
       ExitCode::kDatabaseUnusable,
       "results.sqlite"},
      {"server with a database that cannot be written",
       {server, "--db", "/proc/results.sqlite", "--port", free},
       ExitCode::kDatabaseUnusable,
       "/proc/results.sqlite"}};
  // Root needs no user namespace, and cannot create one in a chroot.
  const bool as_root = Unshares(kOwnNetwork);
  const bool as_own_user = Unshares(kOwnUser);
  if (as_root || as_own_user) {
    const std::vector<std::string> alone = {kUnshare, as_root ? kOwnNetwork : kOwnUser};
    for (const auto& [name, command] :
         {std::pair<std::string, std::vector<std::string>>{"server", {server, "--db", fresh}},
          {"worker", {worker, "--slots", "1"}},
          {"client", {client, "status"}}}) {
      std::vector<std::string> all = alone;
      all.insert(all.end(), command.begin(), command.end());
      cases.push_back({name + " without a multicast route", all, ExitCode::kNetworkUnusable, "ip route add"});
    }
  } else {
    findings.Note("without a multicast route: not measured, 'unshare -n' and 'unshare -Urn' are refused here");
  }
  for (const Case& refused : cases) MeasureRefusal(refused, findings);
  if (as_own_user) {
    MeasureSmallBuffer(server, fresh, findings);
  } else {
    findings.Note("small receive buffer: not measured, 'unshare -Urn' is refused here");
  }
}

}  // namespace legopt::figures
