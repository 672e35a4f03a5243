#include "worker/external/external_solvers.h"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

#include "app/processes.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/solvers/methods/internal/option_visitors.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/types/input_error.h"
#include "worker/external/external_solver.h"
#include "worker/external/line_channel.h"
#include "worker/external/solver_confinement.h"

namespace legopt::external {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr double kShortestSilence_s = 0.1, kLongestSilence_s = 86'400;
constexpr std::size_t kMaxWordBytes = 60;

std::string ContentOf(const fs::path& file, const std::string& source, const std::string& field) {
  constexpr std::size_t kMostBytes = std::size_t{2} << 30;
  try {
    if (fs::is_regular_file(file)) return ReadFileText(file, kMostBytes);
  } catch (const InputError&) {  // the fault is reported as one of the declaration
  }
  throw InputError({source, field, file.string(), "cannot be read", "give a file that this user may read"});
}

// Returns the texts of a list; adds a fault for every other value.
std::vector<std::string> ReadTexts(OptionReader& reader, const char* key, OptionDiagnostics& faults) {
  std::vector<std::string> texts;
  const json* list = reader.Find(key);
  if (list == nullptr) return texts;
  const auto is_text = [](const json& item) { return item.is_string() && !item.get_ref<const std::string&>().empty(); };
  if (!list->is_array() || !std::ranges::all_of(*list, is_text)) {
    faults.Add(key, Dump(*list), "must be a list of texts", std::string("write \"") + key + "\": [\"...\"]");
    return texts;
  }
  return list->get<std::vector<std::string>>();
}

void ReadName(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  static const SolverRegistry kOwn;
  if (!reader.Text("name", declaration.name)) {
    if (!faults.Has("name")) faults.Add("name", "", "is missing", "add the word that suites use as 'solver'");
    return;
  }
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (declaration.name.size() > kMaxWordBytes || !std::ranges::all_of(declaration.name, plain)) {
    faults.Add("name", declaration.name, "must be a word of at most 60 letters, digits, '_' and '-'", "choose another");
  } else if (kOwn.Find(declaration.name) != nullptr) {
    faults.Add("name", declaration.name, "is a solver of legopt", "choose another");
  }
}

void FindExecutable(Declaration& declaration, OptionDiagnostics& faults) {
  const std::string& word = declaration.command.front();
  const bool is_path = word.find('/') != std::string::npos;
  const fs::path found = is_path ? (declaration.folder / word).lexically_normal() : app::FindProgram(word);
  if (found.empty() || !app::IsExecutable(found)) {
    faults.Add("command", word, is_path ? "there is no executable file " + found.string() : "is not in PATH",
               is_path ? "paths are relative to the declaration's folder; chmod +x where it is there"
                       : "install it, or give a path such as './" + word + "'");
    return;
  }
  declaration.executable = found;
}

void ReadCommand(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  declaration.command = ReadTexts(reader, "command", faults);
  if (faults.Has("command")) return;
  if (declaration.command.empty()) {
    faults.Add("command", "", "is missing or empty", "add it, for example [\"python3\", \"my_solver.py\"]");
    return;
  }
  FindExecutable(declaration, faults);
  // A script named in the command belongs to the solver, even if `files` does not list it.
  for (std::size_t i = 1; i < declaration.command.size(); ++i) {
    std::error_code ignored;
    const fs::path file = (declaration.folder / declaration.command[i]).lexically_normal();
    if (fs::is_regular_file(file, ignored)) declaration.files.push_back(file);
  }
}

void ReadFiles(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  for (const std::string& word : ReadTexts(reader, "files", faults)) {
    const fs::path file = (declaration.folder / word).lexically_normal();
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) {
      faults.Add("files", word, "there is no file " + file.string(), "paths are relative to the declaration's folder");
    }
    declaration.files.push_back(file);
  }
}

void ReadLevel(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  std::string word = "lines";
  reader.Text("level", word);
  if (word != "lines" && word != "files")
    faults.Add("level", word, "must be 'lines' or 'files'", "see docs/reference/external-solvers.md");
  declaration.level = word == "files" ? ChannelType::kFiles : ChannelType::kLines;
}

void ReadSettings(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  declaration.settings = json::object();
  const json* settings = reader.Find("settings");
  if (settings != nullptr && OptionReader::IsMap(*settings, "settings", faults)) declaration.settings = *settings;
}

void ReadSurroundings(OptionReader& reader, Declaration& declaration, OptionDiagnostics& faults) {
  declaration.environment = ReadTexts(reader, "environment", faults);
  reader.Boolean("network", declaration.network);
  for (const std::string& name : declaration.environment) {
    if (MayPassOn(name)) continue;
    faults.Add("environment", name, "is not passed on to a solver", "name variables that are not legopt's own");
  }
}

}  // namespace

Declaration ReadDeclaration(const fs::path& file) {
  const json object = ReadJsonFile(file);
  OptionDiagnostics faults(file.string());
  Declaration declaration;
  declaration.file = file.string();
  // A pipe has no folder, so the current one is used.
  declaration.folder = files::IsStream(file) ? fs::current_path() : fs::absolute(file).lexically_normal().parent_path();
  if (!OptionReader::IsMap(object, "", faults)) faults.ThrowIfAny();
  OptionReader reader(object, "", faults);
  ReadName(reader, declaration, faults);
  ReadLevel(reader, declaration, faults);
  ReadCommand(reader, declaration, faults);
  ReadFiles(reader, declaration, faults);
  ReadSettings(reader, declaration, faults);
  ReadSurroundings(reader, declaration, faults);
  reader.Number("timeout_s", declaration.timeout_s, kShortestSilence_s, kLongestSilence_s);
  reader.RejectUnknownKeys();
  faults.ThrowIfAny();
  declaration.hash = CurrentHash(declaration);
  return declaration;
}

std::vector<Declaration> ReadDeclarations(std::span<const fs::path> files) {
  std::vector<Declaration> declarations;
  for (const fs::path& file : files) {
    Declaration read = ReadDeclaration(file);
    const auto same = std::ranges::find(declarations, read.name, &Declaration::name);
    if (same != declarations.end()) {
      throw InputError(
          {read.file, "name", read.name, "is declared in " + same->file + ", too", "give one of them another name"});
    }
    declarations.push_back(std::move(read));
  }
  return declarations;
}

std::string CurrentHash(const Declaration& declaration) {
  json parts = {{"command", declaration.command}, {"settings", declaration.settings}};
  if (declaration.level == ChannelType::kFiles) parts["level"] = "files";
  parts["executable"] = Blake2bHex(ContentOf(declaration.executable, declaration.file, "command"));
  for (const fs::path& file : declaration.files) {
    parts["files"].push_back(Blake2bHex(ContentOf(file, declaration.file, "files")));
  }
  return Blake2bHex(Dump(parts));
}

namespace {

constexpr double kAhead_m = 0.03;  // distance from which rows appear, before they are violated

// Returns the current hash. Unreadable files are treated as missing.
std::string HashNow(const Declaration& declaration) {
  try {
    return CurrentHash(declaration);
  } catch (const InputError& error) {
    throw SolverUnavailable(error.fault());
  }
}

// Requires that the solver to be run is the one that the method names.
void RequireDeclared(const ExternalOptions& options, const Declaration& declaration) {
  const std::string source = "solver '" + declaration.name + "' (external)";
  if (options.declaration != declaration.hash) {
    throw SolverUnavailable(
        {source, "declaration", options.declaration,
         "the job was submitted with another declaration than " + declaration.file + " of this worker, whose hash is " +
             declaration.hash,
         "start client and workers with --solver and equal files: command, settings, executable, scripts"});
  }
  if (const std::string now = HashNow(declaration); now != declaration.hash) {
    throw SolverUnavailable(
        {source, "declaration", now,
         "a file of the solver has changed since the worker was started, when the hash was " + declaration.hash,
         "start the worker again, and submit again for the changed solver"});
  }
}

std::unique_ptr<Solver> MakeExternal(const ExternalOptions& options, std::size_t number, const Declaration& declaration,
                                     const SolverStarter& start) {
  if (!start) {
    throw InputError({declaration.file, "name", declaration.name, "is not run by this program",
                      "solve with legopt-worker --solver " + declaration.file});
  }
  RequireDeclared(options, declaration);
  ExternalProtocol manner{declaration.name, declaration.settings, declaration.timeout_s};
  manner.has_no_requests = declaration.level == ChannelType::kFiles;
  auto solver = std::make_unique<ExternalSolver>(options, std::move(manner),
                                                 [number, declaration, start] { return start(number, declaration); });
  solver->Start();
  return solver;
}

}  // namespace

SolverRegistry RegistryWith(std::span<const Declaration> declarations, const SolverStarter& start) {
  SolverRegistry registry;
  for (std::size_t number = 0; number < declarations.size(); ++number) {
    const Declaration& declaration = declarations[number];
    registry.Register<ExternalOptions>(
        {.word = declaration.name,
         .paper_name = declaration.name + kExternalMark,
         .is_stochastic = true,
         .mark = kExternalMark,
         .contact_range_m = kAhead_m},
        [number, declaration, start](const ExternalOptions& options, const Sampling&) {
          return MakeExternal(options, number, declaration, start);
        },
        ExternalOptions{.declaration = declaration.hash});
  }
  return registry;
}

ExternalSolvers::ExternalSolvers(std::span<const std::filesystem::path> files)
    : ExternalSolvers(ReadDeclarations(files)) {}

ExternalSolvers::ExternalSolvers(std::vector<Declaration> declarations) : declarations_(std::move(declarations)) {
  if (declarations_.empty()) return;
  if (std::ranges::find(declarations_, ChannelType::kFiles, &Declaration::level) != declarations_.end()) {
    scratch_ = MakeScratchFolder();
  }
  std::vector<LaunchCommand> commands;
  for (const Declaration& declaration : declarations_) {
    commands.push_back({declaration.executable, declaration.command, declaration.folder, declaration.environment,
                        declaration.network});
    if (declaration.level == ChannelType::kLines) continue;
    for (const auto& file : {ProblemFile(scratch_), SolutionFile(scratch_)}) {
      commands.back().arguments.push_back(file.string());
    }
  }
  launcher_ = std::make_unique<SolverLauncher>(commands, scratch_);
}

ExternalSolvers::~ExternalSolvers() = default;

std::unique_ptr<LineChannel> ExternalSolvers::Start(std::size_t number) {
  const Declaration& declaration = declarations_[number];
  if (declaration.level == ChannelType::kLines)
    return std::make_unique<SolverProcess>(*launcher_, number, memory_bytes_);
  return std::make_unique<FileChannel>(*launcher_, number, memory_bytes_, declaration.name, scratch_);
}

ProcessUsage ExternalSolvers::TakeUsage() { return launcher_ == nullptr ? ProcessUsage() : launcher_->TakeUsage(); }

SolverRegistry ExternalSolvers::registry() {
  return RegistryWith(declarations_, [this](std::size_t number, const Declaration&) { return Start(number); });
}

SolverRegistry RegistryForForks(std::span<const Declaration> declarations) {
  const auto solvers = std::make_shared<std::unique_ptr<ExternalSolvers>>();
  const std::vector<Declaration> all(declarations.begin(), declarations.end());
  return RegistryWith(declarations, [solvers, all](std::size_t number, const Declaration&) {
    if (*solvers == nullptr) *solvers = std::make_unique<ExternalSolvers>(all);
    return (*solvers)->Start(number);
  });
}

}  // namespace legopt::external
