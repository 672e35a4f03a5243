#include "client/pool/ssh_pool.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "client/client_error.h"
#include "client/pool/engine_call.h"
#include "client/service/managed_pool.h"
#include "legopt/files/written_file.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;
using std::chrono::system_clock;

constexpr int kSshFailed = 255, kNotFound = 127, kNotExecutable = 126;

// Do not wait for hosts that are switched off or ask for a password. Options of the pool file come first, because ssh
// uses the first value.
constexpr const char* kSshPatience[] = {"BatchMode=yes", "ConnectTimeout=20", "ServerAliveInterval=15",
                                        "ServerAliveCountMax=4"};

void Write(const app::Descriptor& pipe, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(pipe.get(), text.data(), text.size());
    if (count < 0 && errno != EINTR) return;  // Look() detects the end
    if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
  }
}

std::string LogName(const std::string& host) {
  std::string name = host;
  std::replace(name.begin(), name.end(), '/', '_');
  return name + ".log";
}

ExitCode CodeOf(const ChildExit& exit) {
  if (exit.signal != 0) return ExitCode::kEngineRefused;
  if (exit.code == kNotFound || exit.code == kNotExecutable) return ExitCode::kMachine;
  const auto named = static_cast<ExitCode>(exit.code);
  const bool known = std::any_of(app::kExitCodeTexts.begin(), app::kExitCodeTexts.end(),
                                 [named](const auto& row) { return row.code == named; });
  return known ? named : ExitCode::kEngineRefused;
}

std::string EndOf(const fs::path& log) {
  constexpr std::size_t kLogTailBytes = 2000;
  std::string text = ReadWhole(log);
  std::erase(text, '\r');  // written by ssh itself
  return text.substr(text.size() - std::min(text.size(), kLogTailBytes));
}

std::string LastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const auto begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

// Returns an empty text if a signal ended ssh. Otherwise returns the last line of ssh or the remote shell if they
// failed, else the error that the worker reported.
std::string CauseIn(const fs::path& log, const ChildExit& exit) {
  if (exit.signal != 0) return {};
  const std::string text = EndOf(log);
  const bool no_worker = exit.code == kSshFailed || exit.code == kNotFound || exit.code == kNotExecutable;
  const std::string cause = no_worker ? LastLine(text) : LastErrorMessage("legopt-worker", text);
  return ": " + (cause.empty() ? "no error in " + log.string() : cause);
}

}  // namespace

std::vector<std::string> SshArguments(const PoolFile& pool, const std::string& host) {
  std::vector<std::string> arguments = {"-T"};
  const auto add = [&arguments](const std::string& option) { arguments.insert(arguments.end(), {"-o", option}); };
  for (const EngineOption& option : pool.options) add(option.key + "=" + option.value.value_or("yes"));
  for (const char* option : kSshPatience) add(option);
  arguments.insert(arguments.end(), {"--", host, "exec sh -s"});
  return arguments;
}

SshPool::SshPool(const PoolFile& pool, const PoolAccess& access) {
  RequireEngineProgram("ssh");
  ::signal(SIGPIPE, SIG_IGN);  // a connection may have just ended
  for (const std::string& host : pool.hosts) connections_.push_back(Connect(pool, access, host));
}

SshPool::Connection SshPool::Connect(const PoolFile& pool, const PoolAccess& access, const std::string& host) const {
  Connection connection;
  connection.name = host;
  connection.log = fs::path(access.logs) / LogName(host);
  std::optional<app::Pipe> orders = app::MakePipe();
  const app::Descriptor log(files::OpenToAppend(connection.log, files::kReadableByOwner));
  if (!orders) throw std::system_error(errno, std::generic_category(), "no pipe to ssh");
  connection.ssh = std::make_unique<ChildProcess>(app::FindProgram("ssh"), SshArguments(pool, host),
                                                  ChildFiles{orders->read.get(), log.get()});
  connection.orders = std::move(orders->write);
  connection.since = system_clock::now();
  Write(connection.orders, HostScript(pool, access, host));
  return connection;
}

std::string SshPool::StateOf(const Connection& connection) {
  if (!connection.exit) return "connected";
  const ChildExit& exit = *connection.exit;
  if (exit.signal != 0) return connection.closed ? "ended by us" : "ssh ended with " + exit.Describe();
  if (exit.code == kSshFailed) return "no connection";
  return exit.code == 0 ? "left" : "ended with " + exit.Describe();
}

bool SshPool::Look() {
  bool news = false;
  for (Connection& connection : connections_) {
    if (connection.exit) continue;
    connection.exit = connection.ssh->Poll();
    if (!connection.exit) continue;
    connection.since = system_clock::now();
    news = true;
  }
  return news;
}

bool SshPool::over() const {
  return std::all_of(connections_.begin(), connections_.end(), [](const auto& each) { return each.exit.has_value(); });
}

std::vector<SshPool::Host> SshPool::hosts() const {
  std::vector<Host> hosts;
  for (const Connection& each : connections_) hosts.push_back({each.name, StateOf(each), each.since});
  return hosts;
}

void SshPool::OrderToStop() {
  for (Connection& connection : connections_) {
    if (!connection.exit) Write(connection.orders, "stop\n");
  }
}

void SshPool::Close() {
  for (Connection& connection : connections_) {
    connection.orders.Close();
    connection.closed = true;
    connection.ssh->Signal(SIGTERM);
  }
}

std::vector<SshPool::Failure> SshPool::Failures() const {
  std::vector<Failure> failures;
  for (const Connection& each : connections_) {
    if (!each.exit || (each.exit->signal != 0 ? each.closed : each.exit->code == 0)) continue;
    if (each.exit->code == StatusOf(ExitCode::kInterrupted)) continue;  // caused by the second order to stop
    failures.push_back({CodeOf(*each.exit), each.name + ": " + StateOf(each) + CauseIn(each.log, *each.exit)});
  }
  return failures;
}

namespace {

using std::chrono::milliseconds;

constexpr char kHostsFile[] = "hosts-";  // and the keeper's process id
constexpr milliseconds kKeeperInterval{100};
constexpr milliseconds kReleaseTimeout{10'000};  // time for workers to release their jobs and end

// Returns the start time in ticks since boot; 0: no such process, or unknown (no /proc).
std::uint64_t StartOf(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto name_end = text.rfind(')');  // the process name may contain any character
  if (name_end == std::string::npos) return 0;
  ClassicInput fields(text.substr(name_end + 1));
  constexpr int kFieldsBefore = 19;  // counted from the third field
  std::string skipped;
  for (int i = 0; i < kFieldsBefore; ++i) fields >> skipped;
  std::uint64_t start = 0;
  fields >> start;
  return skipped.empty() ? 0 : start;
}

}  // namespace

PoolProcess PoolProcess::ThisProcess() { return {::getpid(), StartOf(::getpid())}; }

std::optional<PoolProcess> PoolProcess::FromId(const std::string& id) {
  ClassicInput words(id);
  int pid = 0;
  std::uint64_t started = 0;
  if (!(words >> pid >> started) || pid <= 0) return std::nullopt;
  return PoolProcess(pid, started);
}

bool PoolProcess::runs() const {
  if (started_ == 0)
    return ::kill(pid_, 0) == 0 || errno == EPERM;  // recorded without /proc: only the process id is
                                                    // known
  return StartOf(pid_) == started_;
}

bool PoolProcess::EndsWithin(milliseconds duration, bool (*give_up)()) const {
  for (const auto end = std::chrono::steady_clock::now() + duration; runs();) {
    if (std::chrono::steady_clock::now() >= end || (give_up != nullptr && give_up())) return false;
    std::this_thread::sleep_for(kKeeperInterval);
  }
  return true;
}

void PoolProcess::Stop(milliseconds patience, bool (*give_up)()) const {
  if (!runs()) return;
  ::kill(pid_, SIGTERM);
  // Leave time between the signals: simultaneous signals of one kind are merged.
  if (EndsWithin(std::max(patience, 3 * kKeeperInterval), give_up) || !runs()) return;
  ::kill(pid_, SIGTERM);
  if (EndsWithin(kReleaseTimeout, give_up) || !runs()) return;
  ::kill(pid_, SIGKILL);
}

HostsFile::HostsFile(const fs::path& folder, const PoolProcess& keeper)
    : path_(folder / (kHostsFile + std::to_string(keeper.pid()))) {}

void HostsFile::Remove() const {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void HostsFile::Write(const std::vector<SshPool::Host>& hosts) const {
  ClassicOutput text;
  for (const SshPool::Host& host : hosts) {
    text << host.name << '\t' << system_clock::to_time_t(host.since) << '\t' << host.state << '\n';
  }
  try {
    files::ReplaceFile(path_, text.str(), {files::kReadableByAll, files::Durability::kBuffered});
  } catch (const files::FileError&) {
    return;  // display only, never needed
  }
}

std::vector<SshPool::Host> HostsFile::Read() const {
  std::vector<SshPool::Host> hosts;
  std::ifstream stream(path_);
  SshPool::Host host;
  for (std::string since; std::getline(stream, host.name, '\t') && std::getline(stream, since, '\t') &&
                          std::getline(stream, host.state);) {
    host.since = system_clock::from_time_t(ParseInteger<std::time_t>(since).value_or(0));
    hosts.push_back(host);
  }
  return hosts;
}

}  // namespace legopt::client
