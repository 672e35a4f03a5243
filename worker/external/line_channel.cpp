#include "worker/external/line_channel.h"

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "app/printable.h"
#include "app/processes.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/types/number_text.h"
#include "worker/external/protocol.h"

namespace legopt::external {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 16;
constexpr std::size_t kLastWordsBytes = 300;

/// Prevents SIGPIPE from ending this process when it writes to a closed pipe, regardless of its handlers: blocks the
/// signal and discards it.
class WithoutBrokenPipes {
 public:
  WithoutBrokenPipes() {
    sigemptyset(&broken_pipe_);
    sigaddset(&broken_pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &broken_pipe_, &former_);
  }
  ~WithoutBrokenPipes() {
    if (sigismember(&former_, SIGPIPE) == 1) return;
    const timespec now{};
    while (sigtimedwait(&broken_pipe_, nullptr, &now) < 0 && errno == EINTR) {
    }
    pthread_sigmask(SIG_SETMASK, &former_, nullptr);
  }
  WithoutBrokenPipes(const WithoutBrokenPipes&) = delete;
  WithoutBrokenPipes& operator=(const WithoutBrokenPipes&) = delete;

 private:
  sigset_t broken_pipe_{}, former_{};
};

int MillisecondsUntil(LineChannel::Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - LineChannel::Clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1'000'000));
}

std::string HowItEnded(const ProcessEnd& end, std::int64_t memory_bytes) {
  if (end.killed) return "closed its standard output before its solution";
  if (!WIFSIGNALED(end.status)) return "ended with " + app::ExitCodeMeaning(WEXITSTATUS(end.status));
  const int number = WTERMSIG(end.status);
  const std::string ended = "was ended by signal " + std::to_string(number) + ", " + app::SignalMeaning(number);
  if (number == SIGXFSZ)
    return ended + ": it may write files of " + std::to_string(SolverLauncher::kMaxFileBytes >> 20) + " MiB at most";
  return memory_bytes > 0 ? ended + "; its memory is limited to " + std::to_string(memory_bytes >> 20) + " MiB" : ended;
}

// Returns the last line that is not blank.
std::string LastLine(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  const auto begin = text.rfind('\n');
  return app::Printable(begin == std::string::npos ? text : text.substr(begin + 1));
}

}  // namespace

SolverProcess::SolverProcess(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes,
                             OutputKind speech)
    : launcher_(launcher),
      streams_(launcher.Start(command, memory_bytes)),
      memory_bytes_(memory_bytes),
      speech_(speech) {}

SolverProcess::~SolverProcess() {
  try {
    launcher_.End(false);
    ReadError();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "an external solver was left behind: %s\n", error.what());
  }
}

// Waits. Returns true if something is ready; output of the solver has been read then.
bool SolverProcess::Wait(Clock::time_point deadline, bool to_write) {
  // The process is first, so that output from before its end is read.
  std::array<pollfd, 4> ready = {pollfd{streams_.process.get(), POLLIN, 0}, pollfd{streams_.out.get(), POLLIN, 0},
                                 pollfd{streams_.error.get(), POLLIN, 0},
                                 pollfd{to_write ? streams_.in.get() : -1, POLLOUT, 0}};
  const int count = ::poll(ready.data(), ready.size(), MillisecondsUntil(deadline));
  if (count < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category(), "poll");
  if (count <= 0) return count < 0;
  if (ready[2].revents != 0) ReadError();
  if (ready[1].revents != 0) ReadOutput();
  ended_ = ready[0].revents != 0 && ready[1].revents == 0;
  return true;
}

// Writes bytes. Returns false if the pipe is currently full.
bool SolverProcess::Write(std::string_view& bytes) {
  const WithoutBrokenPipes guard;
  const ssize_t count = ::write(streams_.in.get(), bytes.data(), bytes.size());
  if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
  if (count >= 0 || errno == EINTR) return true;
  if (errno != EAGAIN) bytes = {};  // it has closed its input; its output or its end is detected when reading
  return false;
}

void SolverProcess::Send(std::string_view line, Clock::time_point deadline) {
  if (line.size() > kMaxLineBytes) {
    throw SolverFault("asked for an answer of " + std::to_string(line.size()) +
                      " bytes, longer than the protocol allows");
  }
  const std::string whole = std::string(line) + "\n";
  std::string_view rest = whole;
  while (!rest.empty() && !ended_) {
    if (Write(rest) || rest.empty()) continue;
    if (Clock::now() >= deadline) throw SolverFault("did not read its input");
    Wait(deadline, true);
    RequireShort();
  }
}

std::optional<std::string> SolverProcess::Receive(Clock::time_point deadline) {
  for (;;) {
    if (auto line = TakeLine()) {
      if (!std::exchange(line_received_, true) && speech_ == OutputKind::kLines) launcher_.CountFromNow();
      return line;
    }
    RequireShort();
    if (ended_ || (speech_ == OutputKind::kLines && !streams_.out.open())) ThrowSolverEnded();
    if (!Wait(deadline, false) && Clock::now() >= deadline) return std::nullopt;
  }
}

std::optional<std::string> SolverProcess::TakeLine() {
  const auto end = output_.find('\n', scanned_);
  scanned_ = end == std::string::npos ? output_.size() : 0;
  if (end > kMaxLineBytes) return std::nullopt;  // also if there is none: npos
  std::string line = output_.substr(0, end);
  output_.erase(0, end + 1);
  return line;
}

void SolverProcess::RequireShort() const {
  if (output_.size() > kMaxLineBytes) {
    throw SolverFault("sent more than " + std::to_string(kMaxLineBytes >> 20) +
                      " MiB without being asked, or in one line");
  }
}

void SolverProcess::ReadOutput() {
  std::array<char, kPieceBytes> piece;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  const ssize_t count = ::read(streams_.out.get(), piece.data(), piece.size());
  if (count > 0) output_.append(piece.data(), static_cast<std::size_t>(count));
  if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) streams_.out.Close();
}

void SolverProcess::ReadError() {
  std::array<char, kPieceBytes> piece;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read()
  const ssize_t count = streams_.error.open() ? ::read(streams_.error.get(), piece.data(), piece.size()) : -1;
  if (count == 0) streams_.error.Close();
  if (count <= 0) return;
  std::fwrite(piece.data(), 1, static_cast<std::size_t>(count), stderr);
  stderr_tail_.append(piece.data(), static_cast<std::size_t>(count));
  if (stderr_tail_.size() > kLastWordsBytes) stderr_tail_.erase(0, stderr_tail_.size() - kLastWordsBytes);
}

void SolverProcess::ThrowSolverEnded() {
  const ProcessEnd end = launcher_.End(true);
  ReadError();
  const std::string line = LastLine(stderr_tail_);
  throw SolverEnded(HowItEnded(end, memory_bytes_) + (line.empty() ? "" : "; its last words: " + line), end);
}

namespace {

namespace fs = std::filesystem;

// Reads a solution file. Anything but a regular file, e.g. a pipe without a writer, counts as missing.
std::string ReadSolutionFile(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(file, error))) throw SolverFault("ended without a solution file");
  if (fs::file_size(file, error) > kMaxLineBytes || error) {
    throw SolverFault("left a solution file of more than " + std::to_string(kMaxLineBytes >> 20) + " MiB");
  }
  std::ifstream stream(file, std::ios::binary);
  ClassicOutput text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace

fs::path MakeScratchFolder() { return files::CreateTemporaryFolder("legopt-solver-"); }

fs::path ProblemFile(const fs::path& scratch) { return scratch / "problem.json"; }

fs::path SolutionFile(const fs::path& scratch) { return scratch / "solution.json"; }

FileChannel::FileChannel(SolverLauncher& launcher, std::size_t command, std::int64_t memory_bytes,
                         const std::string& name, fs::path scratch)
    : launcher_(launcher),
      command_(command),
      memory_bytes_(memory_bytes),
      scratch_(std::move(scratch)),
      said_(HelloLine(name)) {}

void FileChannel::Send(std::string_view line, Clock::time_point) {
  if (line != CancelLine()) return Begin(line);
  process_.reset();
  said_ = StoppedLine(num_variables_);
}

void FileChannel::Begin(std::string_view solve) {
  process_.reset();
  num_variables_ = ParseJson(solve, "problem").at("variables").get<int>();
  std::error_code ignored;
  fs::remove_all(SolutionFile(scratch_), ignored);
  fs::remove_all(ProblemFile(scratch_), ignored);  // even if it is a folder or a link now
  try {
    files::CreateFile(ProblemFile(scratch_), std::string(solve) + "\n",
                      {files::kReadableByAll, files::Durability::kBuffered});
  } catch (const files::FileError& error) {
    throw SolverFault(std::string("cannot be handed its problem: ") + error.what());
  }
  process_ = std::make_unique<SolverProcess>(launcher_, command_, memory_bytes_, OutputKind::kLog);
}

std::optional<std::string> FileChannel::Receive(Clock::time_point deadline) {
  if (said_) return std::exchange(said_, std::nullopt);
  if (process_ == nullptr) throw SolverFault("has no problem to solve");
  try {
    while (const auto line = process_->Receive(deadline)) std::fprintf(stderr, "%s\n", line->c_str());
    return std::nullopt;
  } catch (const SolverEnded& ended) {
    process_.reset();
    return Outcome(ended);
  }
}

std::string FileChannel::Outcome(const SolverEnded& ended) const {
  const ProcessEnd& end = ended.end();
  if (end.killed || !WIFEXITED(end.status) || WEXITSTATUS(end.status) != 0) throw SolverFault(ended.what());
  return SolutionLine(ReadSolutionFile(SolutionFile(scratch_)), num_variables_);
}

}  // namespace legopt::external
