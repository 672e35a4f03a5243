#include "worker/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sodium.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "app/processes.h"
#include "bus/codec.h"
#include "legopt_msg/hello_request.hpp"
#include "worker/job_executor.h"
#include "worker/job_process.h"

namespace legopt::worker {
namespace {

constexpr std::uint32_t kMagic = 0x4c474a31;  // "LGJ1"
constexpr std::size_t kTypeOffset = 4;
constexpr std::size_t kSequenceOffset = 8;
constexpr std::size_t kLengthOffset = 16;
constexpr std::size_t kHashOffset = 24;
// Consumed frames are removed from the buffer only above this size.
constexpr std::size_t kCompactBytes = 1U << 16;

template <class T>
void Put(std::string& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

template <class T>
T Get(std::string_view bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Protects against accidents, not attacks: a malicious job process can write valid frames itself.
std::uint64_t FrameHash(std::string_view header, std::string_view body) {
  static constexpr std::array<unsigned char, crypto_shorthash_KEYBYTES> kKey = {'l', 'e', 'g', 'o', 'p', 't', ' ', 'j',
                                                                                'o', 'b', ' ', 'f', 'r', 'a', 'm', 'e'};
  const auto hash = [](std::string_view bytes) {
    std::array<unsigned char, crypto_shorthash_BYTES> out{};
    crypto_shorthash(out.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), kKey.data());
    std::uint64_t value = 0;
    std::memcpy(&value, out.data(), sizeof value);
    return value;
  };
  std::string covered(header.substr(kTypeOffset, kHashOffset - kTypeOffset));
  const std::uint64_t body_hash = hash(body);
  covered.append(reinterpret_cast<const char*>(&body_hash), sizeof body_hash);
  return hash(covered);
}

bool KnownType(std::uint32_t type) {
  return type >= static_cast<std::uint32_t>(FrameType::kJob) && type <= static_cast<std::uint32_t>(FrameType::kResult);
}

}  // namespace

std::string EncodeFrame(const Frame& frame) {
  std::string bytes(kFrameHeaderBytes, '\0');
  Put(bytes, 0, kMagic);
  Put(bytes, kTypeOffset, static_cast<std::uint32_t>(frame.type));
  Put(bytes, kSequenceOffset, frame.sequence);
  Put(bytes, kLengthOffset, static_cast<std::uint64_t>(frame.body.size()));
  Put(bytes, kHashOffset, FrameHash(bytes, frame.body));
  return bytes + frame.body;
}

FrameReader::Status FrameReader::Next(Frame* frame, std::string* why) {
  const auto garbage = [&](const char* text) {
    broken_ = true;
    *why = text;
    return Status::kGarbage;
  };
  if (broken_) return garbage("unreadable since an earlier frame");
  const std::string_view rest = std::string_view(buffer_).substr(consumed_);
  // Checks the first bytes of the magic, because a process that writes garbage may never send a whole header.
  const std::size_t magic_bytes = std::min(rest.size(), sizeof kMagic);
  if (std::memcmp(rest.data(), &kMagic, magic_bytes) != 0) return garbage("bytes that begin no frame");
  if (rest.size() < kFrameHeaderBytes) return Status::kNeedMore;
  const auto type = Get<std::uint32_t>(rest, kTypeOffset);
  const auto length = Get<std::uint64_t>(rest, kLengthOffset);
  if (!KnownType(type)) return garbage("a frame of unknown type");
  if (length > kMaxFrameBytes) return garbage("a frame that claims to be too long");
  if (rest.size() - kFrameHeaderBytes < length) return Status::kNeedMore;
  const std::string_view body = rest.substr(kFrameHeaderBytes, length);
  if (FrameHash(rest.substr(0, kFrameHeaderBytes), body) != Get<std::uint64_t>(rest, kHashOffset)) {
    return garbage("a damaged frame");
  }
  frame->type = static_cast<FrameType>(type);
  frame->sequence = Get<std::uint64_t>(rest, kSequenceOffset);
  frame->body = body;
  consumed_ += kFrameHeaderBytes + length;
  if (consumed_ == buffer_.size() || consumed_ > kCompactBytes) {
    buffer_.erase(0, consumed_);
    consumed_ = 0;
  }
  return Status::kFrame;
}

std::string EncodeJob(const legopt_msg::lease& lease, std::string_view options_json) {
  const std::string encoded = bus::Encode(lease);
  const auto length = static_cast<std::uint32_t>(encoded.size());
  std::string body(sizeof length, '\0');
  Put(body, 0, length);
  body += encoded;
  body += options_json;
  return body;
}

bool DecodeJob(std::string_view body, legopt_msg::lease* lease, std::string* options_json) {
  std::uint32_t length = 0;
  if (body.size() < sizeof length) return false;
  length = Get<std::uint32_t>(body, 0);
  body.remove_prefix(sizeof length);
  if (length > body.size()) return false;
  std::optional<legopt_msg::lease> decoded = bus::Decode<legopt_msg::lease>(body.substr(0, length));
  if (!decoded) return false;
  *lease = std::move(*decoded);
  *options_json = body.substr(length);
  return true;
}

// Encodes a hello_request of which only the capabilities are used: its decoder checks names and hashes.
std::string EncodeCapabilities(const std::vector<Capability>& capabilities) {
  legopt_msg::hello_request message{};
  message.protocol_version = bus::kProtocolVersion;
  message.build_id = "child";
  message.processors = 1;
  message.worker_name = "job process";
  message.pid = 1;
  message.slots = 1;
  for (const Capability& capability : capabilities) message.capabilities.push_back(ToMessage(capability));
  return bus::Encode(std::move(message));
}

bool DecodeCapabilities(std::string_view body, std::vector<Capability>* capabilities) {
  const std::optional<legopt_msg::hello_request> message = bus::Decode<legopt_msg::hello_request>(body);
  if (!message) return false;
  capabilities->clear();
  for (const legopt_msg::capability& capability : message->capabilities) {
    const auto kind = ParseEnum<CapabilityKind>(capability.kind);
    if (!kind) return false;
    capabilities->push_back({capability.name, capability.hash, *kind});
  }
  return true;
}

legopt_msg::capability ToMessage(const Capability& capability) {
  legopt_msg::capability message{};
  message.kind = ToString(capability.kind);
  message.name = capability.name;
  message.hash = capability.hash;
  return message;
}

std::string EncodeProgress(int done, int total) {
  std::string body(2 * sizeof(std::int32_t), '\0');
  Put(body, 0, static_cast<std::int32_t>(done));
  Put(body, sizeof(std::int32_t), static_cast<std::int32_t>(total));
  return body;
}

bool DecodeProgress(std::string_view body, int* done, int* total) {
  if (body.size() != 2 * sizeof(std::int32_t)) return false;
  *done = Get<std::int32_t>(body, 0);
  *total = Get<std::int32_t>(body, sizeof(std::int32_t));
  return true;
}

}  // namespace legopt::worker

extern char** environ;

namespace legopt::worker {
namespace {

using app::Descriptor;

constexpr std::size_t kMaxReadBytes = 1U << 20;
constexpr std::int64_t kKibibyte = 1024;

[[noreturn]] void Refuse(const char* what, int error) { throw std::system_error(error, std::generic_category(), what); }

// Returns the environment of job processes. It sets one thread per job, so that timings and results do not depend on
// the machine, and omits the key file, which job processes do not need.
std::vector<std::string> ChildEnvironment() {
  std::vector<std::string> variables;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (!text.starts_with("OMP_NUM_THREADS=") && !text.starts_with("OPENBLAS_NUM_THREADS=") &&
        !text.starts_with("LEGOPT_KEY_FILE="))
      variables.emplace_back(text);
  }
  variables.emplace_back("OMP_NUM_THREADS=1");
  variables.emplace_back("OPENBLAS_NUM_THREADS=1");
  return variables;
}

struct SpawnAttributes {
  SpawnAttributes() {
    posix_spawnattr_init(&value);
    const sigset_t others = SupervisorSignals();
    sigset_t all;
    sigfillset(&all);
    posix_spawnattr_setsigmask(&value, &others);
    posix_spawnattr_setsigdefault(&value, &all);
    posix_spawnattr_setpgroup(&value, 0);
    posix_spawnattr_setflags(&value, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnAttributes() { posix_spawnattr_destroy(&value); }
  posix_spawnattr_t value{};
};

// File actions run in order in the child. `socket` and `log` must be greater than kSocket; otherwise an earlier action
// would overwrite them.
struct SpawnFiles {
  SpawnFiles(int socket, int log) {
    posix_spawn_file_actions_init(&value);
    posix_spawn_file_actions_addopen(&value, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&value, log, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&value, log, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&value, socket, ChildProcess::kSocket);
    posix_spawn_file_actions_addclosefrom_np(&value, ChildProcess::kSocket + 1);
  }
  ~SpawnFiles() { posix_spawn_file_actions_destroy(&value); }
  posix_spawn_file_actions_t value{};
};

int AboveSocket(int fd) {
  const int moved = fcntl(fd, F_DUPFD_CLOEXEC, ChildProcess::kSocket + 1);
  if (moved < 0) Refuse("fcntl(F_DUPFD_CLOEXEC)", errno);
  return moved;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command) {
  std::array<int, 2> sockets{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) Refuse("socketpair", errno);
  Descriptor ours(sockets[0]);
  const Descriptor theirs(sockets[1]);
  std::optional<app::Pipe> log = app::MakePipe();
  if (!log) Refuse("pipe2", errno);
  ours.SetNonBlocking();
  log->read.SetNonBlocking();
  const Descriptor child_socket(AboveSocket(theirs.get()));
  const Descriptor child_log(AboveSocket(log->write.get()));

  std::vector<std::string> arguments = command;
  std::vector<std::string> environment = ChildEnvironment();
  const SpawnAttributes attributes;
  const SpawnFiles files(child_socket.get(), child_log.get());
  const int error = posix_spawn(&pid_, command.front().c_str(), &files.value, &attributes.value,
                                app::Pointers(arguments).data(), app::Pointers(environment).data());
  if (error != 0) Refuse(("cannot start " + command.front() + app::MissingNullDevice()).c_str(), error);
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
  if (pidfd_ < 0) {
    const int open_error = errno;
    Kill();
    app::WaitForEnd(pid_);
    Refuse("pidfd_open", open_error);
  }
  fcntl(pidfd_, F_SETFD, FD_CLOEXEC);
  socket_ = ours.Take();
  log_pipe_ = log->read.Take();
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    Kill();
    app::WaitForEnd(pid_);
  }
  CloseDescriptors();
}

void ChildProcess::CloseDescriptors() {
  for (int* fd : {&socket_, &log_pipe_, &pidfd_}) {
    if (*fd >= 0) close(std::exchange(*fd, -1));
  }
}

bool ChildProcess::Send(const Frame& frame) {
  outgoing_ += EncodeFrame(frame);
  return Flush();
}

bool ChildProcess::Flush() {
  while (!outgoing_.empty() && socket_ >= 0) {
    const ssize_t count = send(socket_, outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count > 0) {
      outgoing_.erase(0, static_cast<std::size_t>(count));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return true;
    } else if (errno != EINTR) {
      outgoing_.clear();
      return false;
    }
  }
  return socket_ >= 0;
}

bool ChildProcess::ReadSocket() {
  std::array<char, kReadBytes> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  for (std::size_t total = 0; total < kMaxReadBytes;) {
    const ssize_t count = read(socket_, buffer.data(), buffer.size());
    if (count > 0) {
      reader_.Append({buffer.data(), static_cast<std::size_t>(count)});
      total += static_cast<std::size_t>(count);
      if (static_cast<std::size_t>(count) < buffer.size()) return true;
    } else if (count < 0 && errno == EINTR) {
      continue;
    } else if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return true;
    } else {
      close(std::exchange(socket_, -1));
      return false;
    }
  }
  return true;
}

std::string ChildProcess::ReadLog() {
  std::string text;
  std::array<char, kReadBytes> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  while (log_pipe_ >= 0 && text.size() < kMaxReadBytes) {
    const ssize_t count = read(log_pipe_, buffer.data(), buffer.size());
    if (count > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(count));
    } else if (count < 0 && errno == EINTR) {
      continue;
    } else {
      if (count == 0) close(std::exchange(log_pipe_, -1));
      break;
    }
  }
  log_tail_ += text;
  if (log_tail_.size() > kMaxLogTailBytes) log_tail_.erase(0, log_tail_.size() - kMaxLogTailBytes);
  return text;
}

void ChildProcess::AskToStop() {
  if (pid_ > 0) kill(pid_, SIGUSR1);
}

void ChildProcess::Kill() {
  if (pid_ <= 0) return;
  kill(-pid_, SIGKILL);
  kill(pid_, SIGKILL);  // needed if it has not entered its own process group yet
}

bool ChildProcess::Reap(ChildExit* exit) {
  siginfo_t ended{};
  if (pid_ <= 0 || waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0) return false;
  if (ended.si_pid != pid_) return false;
  // Kills remaining processes of the group before its number can be reused.
  kill(-pid_, SIGKILL);
  int status = 0;
  rusage usage{};
  if (wait4(pid_, &status, 0, &usage) != pid_) return false;
  pid_ = -1;
  ReadLog();
  exit->signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  exit->exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  exit->log_tail = log_tail_;
  exit->peak_memory_bytes = static_cast<std::int64_t>(usage.ru_maxrss) * kKibibyte;
  return true;
}

}  // namespace legopt::worker
