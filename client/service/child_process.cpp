#include "client/service/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "app/processes.h"
#include "client/client_error.h"
#include "legopt/files/written_file.h"

namespace legopt::client {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPollInterval{20};
constexpr int kCannotStart = 127;
constexpr std::size_t kKeptOutputBytes = 1U << 20;
constexpr off_t kTailBytes = 64 << 10;  // warnings may follow an error

[[noreturn]] void Fail(const std::filesystem::path& program, const std::string& what) {
  throw ClientError(ExitCode::kMachine, "cannot start " + program.string() + app::MissingNullDevice() + ": " + what);
}

// Runs between fork and exec, so it uses only async-signal-safe calls. Writes the errno of a failed exec to `failure`,
// which is closed by a successful exec.
[[noreturn]] void BecomeProgram(char* const* arguments, pid_t parent, int error, const ChildFiles& files, int failure,
                                std::span<const int> kept) {
  ::setpgid(0, 0);
  if (!app::DieWith(parent, SIGTERM)) ::_exit(kCannotStart);
  app::UnblockSignals();
  app::RestoreStartState();
  ::dup2(files.input, STDIN_FILENO);
  ::dup2(files.output, STDOUT_FILENO);
  if (error >= 0) ::dup2(error, STDERR_FILENO);
  for (const int descriptor : kept) ::fcntl(descriptor, F_SETFD, 0);
  ::execv(arguments[0], arguments);
  const int refusal = errno;
  [[maybe_unused]] const ssize_t written = ::write(failure, &refusal, sizeof(refusal));
  ::_exit(kCannotStart);
}

// Returns 0 or errno. The limit on file sizes also applies to memory files, and cuts a write without an error.
int WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(fd, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count < 0 ? errno : EIO;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return 0;
}

// Returns a readable file that contains `text`.
app::Descriptor Holding(const std::filesystem::path& program, const std::string& text) {
  if (text.empty()) return app::Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  app::Descriptor memory(::memfd_create("legopt-child-input", MFD_CLOEXEC));
  if (!memory.open()) return memory;
  if (const int error = WriteAll(memory.get(), text); error != 0) {
    throw ClientError(files::IsShortage(error) ? ExitCode::kMachine : ExitCode::kUsage,
                      "the input of " + program.string() + " (" + std::to_string(text.size()) +
                          " bytes) cannot be written: " + files::Explain(error));
  }
  ::lseek(memory.get(), 0, SEEK_SET);
  return memory;
}

}  // namespace

std::string ChildExit::Describe() const {
  if (signal == 0) return app::ExitCodeMeaning(code);
  return "signal " + std::to_string(signal) + ", " + app::SignalMeaning(signal);
}

ChildProcess::ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments, bool quiet,
                           const std::string& input, std::span<const int> kept) {
  std::optional<app::Pipe> output = app::MakePipe();
  if (!output) Fail(program, std::strerror(errno));
  const app::Descriptor given = Holding(program, input);
  if (!given.open()) Fail(program, std::strerror(errno));
  if (quiet) error_ = app::Descriptor(::memfd_create("legopt-child-errors", MFD_CLOEXEC));
  if (error_.open()) ::fcntl(error_.get(), F_SETFL, O_APPEND);
  Start(program, arguments, {given.get(), output->write.get()}, error_.get(), kept);
  output_pipe_ = std::move(output->read);
  output_pipe_.SetNonBlocking();
}

ChildProcess::ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                           const ChildFiles& files) {
  Start(program, arguments, files, files.output, {});
}

void ChildProcess::Start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                         const ChildFiles& files, int error, std::span<const int> kept) {
  if (::access(program.c_str(), X_OK) != 0)
    Fail(program, std::string(std::strerror(errno)) + "; build or install it beside legopt");
  std::vector<std::string> texts = {program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  const std::vector<char*> argv = app::Pointers(texts);
  std::optional<app::Pipe> failure = app::MakePipe();
  if (!failure) Fail(program, std::strerror(errno));
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) BecomeProgram(argv.data(), parent, error, files, failure->write.get(), kept);
  if (pid_ < 0) Fail(program, std::strerror(errno));
  failure->write.Close();
  int refusal = 0;
  ssize_t count = -1;
  do {
    count = ::read(failure->read.get(), &refusal, sizeof(refusal));
  } while (count < 0 && errno == EINTR);
  if (count != sizeof(refusal)) return;
  app::WaitForEnd(std::exchange(pid_, -1));
  Fail(program, std::strerror(refusal));
}

ChildProcess::~ChildProcess() {
  constexpr std::chrono::milliseconds kGrace{2000};
  Stop(kGrace);
}

void ChildProcess::DrainOutput() {
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t count = ::read(output_pipe_.get(), buffer.data(), buffer.size());
    if (count <= 0) break;
    output_.append(buffer.data(), static_cast<std::size_t>(count));
  }
  if (output_.size() > kKeptOutputBytes) output_.erase(0, output_.size() - kKeptOutputBytes);
}

std::optional<ChildExit> ChildProcess::Poll() {
  DrainOutput();
  if (exit_) return exit_;
  int status = 0;
  const pid_t result = ::waitpid(pid_, &status, WNOHANG);
  // ECHILD: its status was collected elsewhere.
  if (result < 0 && errno != EINTR) exit_ = ChildExit{kCannotStart, 0};
  if (result == pid_) {
    exit_ = WIFSIGNALED(status) ? ChildExit{0, WTERMSIG(status)} : ChildExit{WEXITSTATUS(status), 0};
    DrainOutput();
  }
  return exit_;
}

bool ChildProcess::WaitForLine(const std::string& word, std::chrono::milliseconds timeout, bool (*give_up)()) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const bool ended = Poll().has_value();
    const auto found = output_.find(word);
    if (found != std::string::npos && output_.find('\n', found) != std::string::npos) return true;
    if (ended || Clock::now() >= deadline || (give_up != nullptr && give_up())) return false;
    pollfd descriptor{output_pipe_.get(), POLLIN, 0};
    // A closed pipe is always readable: do not spin until the child is reaped.
    if (::poll(&descriptor, 1, static_cast<int>(kPollInterval.count())) > 0 && (descriptor.revents & POLLHUP) != 0) {
      ::poll(nullptr, 0, 1);
    }
  }
}

std::optional<ChildExit> ChildProcess::Wait(std::chrono::milliseconds timeout, bool (*give_up)()) {
  const auto deadline = Clock::now() + timeout;
  while (!Poll()) {
    if (Clock::now() >= deadline || (give_up != nullptr && give_up())) return std::nullopt;
    ::poll(nullptr, 0, static_cast<int>(kPollInterval.count()));
  }
  return exit_;
}

void ChildProcess::Signal(int number) {
  if (!Poll()) ::kill(pid_, number);
}

ChildExit ChildProcess::Stop(std::chrono::milliseconds grace, bool (*give_up)()) {
  Signal(SIGTERM);
  if (!Wait(grace, give_up)) {
    Signal(SIGKILL);
    while (!Poll()) ::poll(nullptr, 0, static_cast<int>(kPollInterval.count()));
  }
  return *exit_;
}

std::string ChildProcess::ErrorTail() const {
  if (!error_.open()) return {};
  const off_t size = ::lseek(error_.get(), 0, SEEK_END);
  const off_t start = std::max<off_t>(0, size - kTailBytes);
  std::string text(static_cast<std::size_t>(std::max<off_t>(0, size - start)), '\0');
  const ssize_t count = ::pread(error_.get(), text.data(), text.size(), start);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (start > 0) text.erase(0, text.find('\n') + 1);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

}  // namespace legopt::client
