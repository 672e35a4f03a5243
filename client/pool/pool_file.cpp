#include "client/pool/pool_file.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>

#include "app/command_line.h"
#include "app/processes.h"
#include "client/client_error.h"
#include "client/suite/yaml_map.h"
#include "legopt/files/written_file.h"
#include "legopt/input/text.h"
#include "legopt/input/yaml.h"
#include "legopt/types/enum_names.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr int kMaxNodes = 100'000, kMostSlots = 1024;
constexpr std::string_view kHostCharacters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_@:%";
constexpr int kDay_s = 86'400, kWeek_s = 604'800;

const std::vector<std::string> kOwnKeys = {"nodes", "at_once", "exclusive", "requeue"};
const std::vector<std::string> kHostKeys = {"hosts", "hosts_file"};

// Batch system options that follow from the pool file, and the keys to use instead.
struct Reserved {
  std::string_view key, instead;
};
constexpr std::array<Reserved, 10> kReserved = {{
    {"array", "say 'nodes', and 'at_once' for the most at a time"},
    {"ntasks", "a worker is one task; say 'nodes' for more workers, 'cpus-per-task' for larger ones"},
    {"signal", "say 'worker: {drain_s: ...}', from which it follows"},
    {"export", "workers need nothing of your environment; set variables in the site's profile"},
    {"wrap", "the script is made by legopt; 'legopt pool slurm --dry-run' prints it"},
    {"wait", "'legopt run --slurm' waits"},
    {"parsable", "remove it"},
    {"test-only", "'legopt pool slurm --dry-run' prints the script without submitting it"},
    {"no-requeue", "say 'requeue: false'"},
    {"nodelist-file", "say 'nodelist'"},
}};

bool IsOneLine(const std::string& text) {
  return std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < ' '; });
}

void CheckKey(const std::string& file, const YAML::Node& node, const std::string& field, const std::string& key,
              const std::vector<std::string>& own) {
  const auto refuse = [&](const std::string& message, const std::string& fix) {
    throw InputError({YamlPlace(file, node), field, "", message, fix});
  };
  const auto reserved =
      std::find_if(kReserved.begin(), kReserved.end(), [&](const auto& row) { return row.key == key; });
  if (reserved != kReserved.end()) refuse("is not for pool files", std::string(reserved->instead));
  if (IsMisspelling(key, own)) refuse("unknown key", SuggestName(key, own) + ", or an option of the engine");
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '+';
  };
  if (!std::all_of(key.begin(), key.end(), plain) || key.front() == '-') {
    refuse("is no name of an option", "write the engine's option without dashes before it, e.g. 'partition: long'");
  }
}

EngineOption ReadOption(const std::string& file, const YAML::Node& key, const YAML::Node& value,
                        const std::string& field) {
  EngineOption option{key.Scalar(), std::nullopt, YamlPlace(file, key)};
  if (value.IsSequence()) {
    std::vector<std::string> items;
    for (const auto& item : value) items.push_back(YamlString(item, file, field));
    option.value = app::Joined(items);
    std::erase(*option.value, ' ');
  } else if (const std::string text = YamlString(value, file, field); text != "true") {
    option.value = text;
  }
  if (option.value && !IsOneLine(*option.value)) {
    throw InputError(
        {option.place, field, "", "holds a line end or another control character", "write it on one line"});
  }
  return option;
}

std::string HostName(const std::string& text, const InputError::Fault& place) {
  if (!text.empty() && text.front() != '-' && text.find_first_not_of(kHostCharacters) == std::string::npos) return text;
  throw InputError({place.file, place.field, text, "is no host as ssh takes it", "write NAME or USER@NAME"});
}

// One host per line; '#' starts a comment.
std::vector<std::string> ReadHostsFile(const std::string& file) {
  std::vector<std::string> hosts;
  ClassicInput lines(ReadFileText(file, kShortYaml.bytes));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    ClassicInput words(line.substr(0, line.find('#')));
    std::string host, more;
    words >> host;
    const InputError::Fault place{file + ":" + std::to_string(number), "", "", "", ""};
    if (words >> more) HostName(host + " " + more, place);
    if (!host.empty()) hosts.push_back(HostName(host, place));
  }
  if (hosts.empty()) throw InputError({file, "", "", "names no host", "write one on each line"});
  return hosts;
}

void ReadHostList(const YamlMap& map, PoolFile& pool) {
  if (map.Has("hosts_file")) {
    const std::filesystem::path beside = std::filesystem::path(pool.file).parent_path();
    pool.hosts = ReadHostsFile((beside / map.String("hosts_file")).string());
    if (map.Has("hosts")) {
      throw YamlFault(pool.file, map.Get("hosts"), map.Path("hosts"), "is given together with hosts_file",
                      "keep one of them");
    }
    return;
  }
  for (const YAML::Node& node : map.List("hosts")) {
    pool.hosts.push_back(HostName(YamlString(node, pool.file, map.Path("hosts")),
                                  {YamlPlace(pool.file, node), map.Path("hosts"), "", "", ""}));
  }
}

// All keys except the hosts are ssh options, as in ssh's configuration file.
void ReadHosts(const YamlMap& top, PoolFile& pool) {
  const YAML::Node section = top.Get("ssh");
  std::vector<std::string> keys = kHostKeys;
  if (section.IsMap()) {
    for (const auto& item : section) {
      const std::string key = YamlString(item.first, pool.file, "ssh");
      if (std::find(kHostKeys.begin(), kHostKeys.end(), key) != kHostKeys.end()) continue;
      CheckKey(pool.file, item.first, "ssh." + key, key, kHostKeys);
      keys.push_back(key);
      pool.options.push_back(ReadOption(pool.file, item.first, item.second, "ssh." + key));
    }
  }
  ReadHostList(YamlMap(section, pool.file, "ssh", keys), pool);
  if (std::set<std::string>(pool.hosts.begin(), pool.hosts.end()).size() < pool.hosts.size()) {
    throw YamlFault(pool.file, section, "ssh", "names a host twice", "a worker takes all of its host; name each once");
  }
  pool.nodes = static_cast<int>(pool.hosts.size());
}

// Reads the section of the batch system: legopt's keys and the system's own options.
void ReadEngine(const YamlMap& top, const std::string& word, PoolFile& pool) {
  const YAML::Node section = top.Get(word);
  std::vector<std::string> keys = kOwnKeys;
  if (section.IsMap()) {
    for (const auto& item : section) {
      const std::string key = YamlString(item.first, pool.file, word);
      if (std::find(kOwnKeys.begin(), kOwnKeys.end(), key) != kOwnKeys.end()) continue;
      const std::string field = word + "." + key;
      CheckKey(pool.file, item.first, field, key, kOwnKeys);
      keys.push_back(key);
      if (item.second.IsScalar() && item.second.Scalar() == "false") continue;
      pool.options.push_back(ReadOption(pool.file, item.first, item.second, field));
    }
  }
  const YamlMap map(section, pool.file, word, keys);
  pool.nodes = static_cast<int>(map.Integer("nodes", 1, kMaxNodes));
  if (map.Has("at_once")) pool.at_once = static_cast<int>(map.Integer("at_once", 1, kMaxNodes));
  if (map.Has("exclusive")) pool.exclusive = map.Boolean("exclusive");
  if (map.Has("requeue")) pool.requeue = map.Boolean("requeue");
}

void ReadWorker(const YamlMap& top, PoolFile& pool) {
  if (!top.Has("worker")) return;
  const YamlMap map(top.Get("worker"), pool.file, "worker",
                    {"slots", "drain_s", "idle_timeout_s", "wait_server_s", "dataset", "key_file", "program"});
  PoolWorker& worker = pool.worker;
  const auto seconds = [&map](const char* key, int low, int high, int& value) {
    if (map.Has(key)) value = static_cast<int>(map.Integer(key, low, high));
  };
  if (map.Has("slots") && map.String("slots") != "granted") {
    worker.slots = static_cast<int>(map.Integer("slots", 1, kMostSlots));
  }
  seconds("drain_s", 0, kDay_s, worker.drain_s);
  seconds("idle_timeout_s", 1, kWeek_s, worker.idle_timeout_s);
  seconds("wait_server_s", 1, kWeek_s, worker.wait_server_s);
  if (map.Has("dataset")) {
    for (const YAML::Node& node : map.List("dataset")) {
      worker.datasets.push_back(YamlString(node, pool.file, map.Path("dataset")));
    }
  }
  const auto path = [&map, &pool](const char* key, std::string& value) {
    if (!map.Has(key)) return;
    value = map.String(key);
    if (value.front() != '/') {
      throw YamlFault(pool.file, map.Get(key), map.Path(key), "is a relative path, which a node cannot resolve",
                      "give a path that begins with '/'");
    }
  };
  path("key_file", worker.key_file);
  path("program", worker.program);
}

}  // namespace

bool PoolFile::Sets(const std::string& key) const {
  return std::any_of(options.begin(), options.end(), [&key](const EngineOption& option) { return option.key == key; });
}

PoolFile ReadPoolFile(const std::string& file, Engine engine) {
  std::vector<std::string> sections = app::EnumNamesOf<Engine>();
  sections.insert(sections.end(), {"worker", "server"});
  PoolFile pool;
  pool.file = file;
  const YamlMap top(ReadYamlFile(file, kShortYaml), file, "", sections);
  if (engine == Engine::kSsh) {
    ReadHosts(top, pool);
  } else {
    ReadEngine(top, std::string(ToString(engine)), pool);
  }
  ReadWorker(top, pool);
  if (top.Has("server")) {
    const YamlMap server(top.Get("server"), file, "server", {"listen"});
    if (server.Has("listen")) pool.listen = server.String("listen");
  }
  return pool;
}

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
