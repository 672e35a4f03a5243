#include "client/pool/script_quoting.h"

#include <algorithm>
#include <string_view>

#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

constexpr std::string_view kPlainCharacters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./+,:=@%&~*";

bool IsPlainWord(const std::string& value) {
  return !value.empty() && value.find_first_not_of(kPlainCharacters) == std::string::npos;
}

bool HasControls(const std::string& value) {
  constexpr unsigned char kDelete = 0x7F;
  return std::ranges::any_of(value, [](unsigned char c) { return c < ' ' || c == kDelete; });
}

// Returns `text` with every `c` replaced by `replacement`.
std::string Replaced(const std::string& text, char c, std::string_view replacement) {
  std::string result;
  for (const char each : text) {
    if (each == c) {
      result += replacement;
    } else {
      result += each;
    }
  }
  return result;
}

void RefuseControls(const std::string& field, const std::string& value) {
  if (!HasControls(value)) return;
  throw InputError({"", field, value, "holds a line end or another control character, which no job script can hold",
                    "rename the file or folder"});
}

// Characters that the batch system interprets in log paths.
std::string_view SpecialInLogs(Engine engine) {
  switch (engine) {
    case Engine::kSlurm:
      return "\\";
    case Engine::kPbs:
      return ":";
    case Engine::kSge:
      return ":,$";
    case Engine::kHtcondor:
    case Engine::kSsh:
      break;
  }
  return "";
}

}  // namespace

void CheckForScript(Engine engine, const PoolFile& pool, const PoolAccess& access) {
  RefuseControls("access file", access.access_file);
  RefuseControls("key file", access.key_file);
  RefuseControls("worker.program", access.program);
  RefuseControls("LEGOPT_DATA", access.data_folder);
  RefuseControls("folder of logs", access.logs);
  RefuseControls("job name", access.job_name);
  for (const std::string& dataset : access.datasets) RefuseControls("worker.dataset", dataset);
  for (const std::string& solver : access.solvers) RefuseControls("--solver", solver);
  for (const std::string& host : pool.hosts) RefuseControls("ssh.hosts", host);
  for (const EngineOption& option : pool.options) RefuseControls(option.key, option.value.value_or(""));
  const std::string_view special = SpecialInLogs(engine);
  if (const auto at = access.logs.find_first_of(special); at != std::string::npos) {
    throw InputError({"", "folder of logs", access.logs,
                      std::string("holds '") + access.logs[at] + "', which this engine interprets in a path",
                      "choose another folder (--folder; of 'legopt run --slurm': --db)"});
  }
}

std::string SlurmWord(const std::string& value) {
  if (IsPlainWord(value)) return value;
  return "'" + Replaced(Replaced(value, '\\', "\\\\"), '\'', "\\'") + "'";
}

std::string SlurmPatternOf(const std::string& path) { return Replaced(path, '%', "%%"); }

std::string QsubWord(const std::string& value) {
  if (IsPlainWord(value)) return value;
  const char quote = value.find('\'') == std::string::npos ? '\'' : '"';
  if (value.find('\\') != std::string::npos || (quote == '"' && value.find('"') != std::string::npos)) {
    throw InputError({"", "", value, "holds a backslash or both kinds of quotes, which a line for qsub cannot hold",
                      "rename the file or folder"});
  }
  return quote + value + quote;
}

std::string CondorWord(const std::string& value) {
  const std::string literal = CondorValue(value);
  if (IsPlainWord(value)) return literal;
  return "'" + Replaced(Replaced(literal, '\'', "''"), '"', "\"\"") + "'";
}

std::string CondorValue(const std::string& value) { return Replaced(value, '$', "$(DOLLAR)"); }

}  // namespace legopt::client
