#include "client/pool/ssh_keeper.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <thread>

#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"
#include "legopt/types/classic_stream.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::system_clock;

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
