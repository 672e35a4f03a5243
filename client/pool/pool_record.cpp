#include "client/pool/pool_record.h"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <optional>

#include "app/processes.h"
#include "client/client_error.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"
#include "legopt/types/enum_names.h"

namespace legopt::client {
namespace {

constexpr char kRecordFile[] = "jobs";

// Returns nullopt if the line is not a pool member.
std::optional<PoolMember> ReadLine(const std::string& line) {
  const auto blank = line.find(' ');
  const auto engine = ParseEnum<Engine>(line.substr(0, blank));
  if (!engine || blank == std::string::npos) return std::nullopt;
  PoolMember member{*engine, line.substr(blank + 1)};
  if (member.id.empty() || member.id.find_first_not_of("0123456789 ") != std::string::npos) return std::nullopt;
  return member;
}

}  // namespace

void AddToRecord(const std::filesystem::path& folder, const PoolMember& member) {
  const std::string line = std::string(ToString(member.engine)) + ' ' + member.id + '\n';
  try {
    const app::Descriptor file(files::OpenToAppend(folder / kRecordFile, files::kReadableByAll));
    const ssize_t count = ::write(file.get(), line.data(), line.size());
    if (count == static_cast<ssize_t>(line.size())) return;
    // A limit on file sizes cuts a write without an error.
    throw files::FileError(folder / kRecordFile, "cannot be written", count < 0 ? errno : EFBIG);
  } catch (const files::FileError& error) {
    const std::string undo =
        member.engine != Engine::kSlurm
            ? ""
            : "; Slurm job " + member.id + " was submitted, 'scancel " + member.id + "' takes it back";
    throw ClientError(ExitCode::kUsage, error.what() + undo);
  }
}

std::vector<PoolMember> ReadRecord(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kRecordFile;
  std::ifstream stream(file);
  if (!stream) {
    throw ClientError(ExitCode::kUsage,
                      folder.string() + " is no folder of a pool: there is no file '" + kRecordFile +
                          "' in it; give the one that 'legopt pool slurm', 'legopt pool ssh' or 'legopt run --slurm' "
                          "has named");
  }
  std::vector<PoolMember> members;
  for (std::string line; std::getline(stream, line);) {
    const auto member = ReadLine(line);
    if (!member) {
      throw ClientError(ExitCode::kUsage,
                        file.string() + ": no line 'ENGINE NUMBER' (got '" + line + "'); only legopt writes this file");
    }
    members.push_back(*member);
  }
  return members;
}

}  // namespace legopt::client
