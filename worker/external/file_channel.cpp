#include "worker/external/file_channel.h"

#include <sys/wait.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/types/classic_stream.h"
#include "worker/external/protocol.h"

namespace legopt::external {
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

fs::path MakeScratchFolder() {
  std::string name = (fs::temp_directory_path() / "legopt-solver-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
  return name;
}

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
