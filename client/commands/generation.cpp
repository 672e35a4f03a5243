#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/certificate_report.h"
#include "client/report/escaped_text.h"
#include "client/report/output.h"
#include "client/report/progress.h"
#include "client/service/interrupt.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/files/name_lock.h"
#include "legopt/math/parallel.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/contact_dataset.h"
#include "legopt/worldgen/dataset_builder.h"
#include "legopt/worldgen/internal/scenario.h"
#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::client {
namespace {

struct ScenarioFlags {
  std::string kind = "garage";
  std::string level = "easier";
  std::uint64_t seed = 1;
  std::string out;
  bool no_pictures = false;
};

void AddSeedFlag(const app::Command& command, ScenarioFlags* flags) {
  command.AddOption("--seed", flags->seed, "All random draws follow from it")
      .ShowDefault()
      .Check(app::WholeNumber(0));  // a negative number would wrap around
}

void AddScenarioFlags(const app::Command& command, ScenarioFlags* flags, const char* kinds) {
  command.AddOption("--kind", flags->kind, kinds).ShowDefault();
  command.AddOption("--level", flags->level, "easier, easy, intermediate or hard").ShowDefault();
  AddSeedFlag(command, flags);
  command.AddOption("--out", flags->out, "Folder to make; it must not exist").Required();
  command.AddFlag("--no-pictures", flags->no_pictures, "Leave the PNG files out");
}

worldgen::ScenarioOptions OptionsOf(const ScenarioFlags& flags) {
  worldgen::ScenarioOptions options;
  options.kind = worldgen::ParseBuildingKind(flags.kind);
  options.level = worldgen::ParseScenarioLevel(flags.level);
  options.seed = flags.seed;
  return options;
}

/// Creates `out` by calling `make` with a temporary folder. The folder is kept after an interruption, or after an error
/// if stances were proven, because the same command then continues from it.
void MakeFolder(const std::filesystem::path& out, const std::string& identity,
                const std::function<void(const std::filesystem::path&, const worldgen::BuildProgress&)>& make) {
  StagedFolder folder(out, identity, Unfinished::kKept);
  const InterruptGuard guard;
  GenerationProgress progress;
  try {
    make(folder.path(), [&](const std::string& stage, double done, double total, const std::string& unit) {
      progress.Show(stage, done, total, unit);
      if (Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
    });
  } catch (const ClientError&) {
    progress.Break();
    throw ClientError(ExitCode::kInterrupted, "interrupted; the same command continues from the finished part in " +
                                                  folder.path().string() + "; to begin anew, remove it");
  } catch (const InputError& error) {
    progress.Break();
    if (!std::filesystem::exists(folder.path() / worldgen::kStancesFileName)) {
      folder.Discard();
      throw;
    }
    InputError::Fault fault = error.fault();
    fault.fix +=
        (fault.fix.empty() ? "" : "; ") + std::string("scene and stances are kept in ") + folder.path().string() +
        ": with another number of plans or postures the command continues from them, " + "for all else remove it";
    throw InputError(std::move(fault));
  }
  progress.Break();
  folder.Finish();
}

ExitCode GenerateScenario(const ScenarioFlags& flags) {
  const worldgen::ScenarioOptions options = OptionsOf(flags);
  const std::string identity = "scenario " + flags.kind + " " + flags.level + " " + std::to_string(flags.seed) + "\n";
  worldgen::Scenario scenario;
  MakeFolder(flags.out, identity, [&](const std::filesystem::path& folder, const worldgen::BuildProgress& progress) {
    scenario =
        worldgen::MakeScenario(options, [&](double done, double total) { progress("collapse", done, total, "s"); });
    worldgen::WriteScenario(scenario, folder, !flags.no_pictures, GuardedReader());
  });
  std::cout << JsonText(worldgen::DescribeScenario(scenario)) << "\n";
  return ExitCode::kOk;
}

/// Value of --kind for problems that hands make possible, each at a station of its own instead of in a building.
constexpr const char* kContactsKind = "contacts";

struct DatasetFlags {
  ScenarioFlags scenario;
  int motions = worldgen::ContactDatasetOptions().motions;
  int traps = worldgen::ContactDatasetOptions().traps;
  std::optional<std::string> robot;
  std::optional<std::string> from;
  std::string name;
  std::optional<int> postures;
  worldgen::DatasetOptions options;
};

/// Adds the options that determine the set of stances.
app::Option AddStanceFlags(const app::Command& command, DatasetFlags* flags) {
  worldgen::DatasetOptions& options = flags->options;
  command.AddOption("--name", flags->name, "Name of the dataset (default: that of the folder)");
  command.AddOption("--radius", options.radius_m, "Largest distance of the feet, m (default: by the robot's size)");
  command.AddOption("--slope", options.slope_rad, "Steepest ground, rad (default: 0.45)");
  options.threads = NumProcessors();
  command.AddOption("--threads", options.threads, "Number of threads, same result for any (default: all cores)");
  return command.AddOption("--stances", options.stances, "Stances sampled").ShowDefault();
}

void AddInstanceFlags(const app::Command& command, DatasetFlags* flags) {
  worldgen::DatasetOptions& options = flags->options;
  app::Option stances = AddStanceFlags(command, flags);
  command
      .AddOption("--proven", options.proven,
                 "Solution file: its stances that have a posture, instead of sampling and proving some here")
      .Excludes(stances);
  command.AddOption("--same-floor", options.same_floor, "Motion problems on one floor").ShowDefault();
  command.AddOption(
      "--different-floors", options.different_floors,
      "Motion problems between floors (default: 25, or on one floor if no two stances are on different floors)");
  command.AddOption("--postures", flags->postures, "Posture problems (default: 50; of kind contacts: 100)");
  command.AddFlag("--certified", options.certified,
                  "Keep plans all of whose stances have a posture, and write the certificate");
}

/// Adds the options of all datasets: the source of robot and scene.
void AddSourceFlags(const app::Command& command, DatasetFlags* flags) {
  command.AddOption("--from", flags->from, "Dataset folder with the robot and the scene; its problems are not used")
      .Required();
  AddSeedFlag(command, &flags->scenario);
  command.AddOption("--out", flags->scenario.out, "Folder to make; it must not exist").Required();
}

using Build = worldgen::DatasetReport (*)(const worldgen::DatasetOptions&, const std::filesystem::path&,
                                          const worldgen::BuildProgress&);

/// Returns the name of the dataset: that of the flag, or of the folder to make.
std::string NameOf(const DatasetFlags& flags) {
  if (!flags.name.empty()) return flags.name;
  const std::filesystem::path out = std::filesystem::path(flags.scenario.out).lexically_normal();
  return (out.has_filename() ? out : out.parent_path()).filename().string();
}

/// Creates the folder with `build`; its identity describes the requested contents.
worldgen::DatasetReport BuildFolder(const DatasetFlags& flags, const std::string& what, Build build) {
  worldgen::DatasetOptions options = flags.options;
  options.read_guard = GuardedReader();
  const std::filesystem::path out = std::filesystem::path(flags.scenario.out).lexically_normal();
  options.name = NameOf(flags);
  options.postures = flags.postures.value_or(options.postures);
  options.seed = flags.scenario.seed;
  options.pictures = !flags.scenario.no_pictures;
  if (flags.from) {
    options.robot_folder = app::NamedDatasetFolder(*flags.from);
  } else {
    options.robot_folder = flags.robot ? app::NamedDatasetFolder(*flags.robot) : app::DefaultDatasetFolder();
    options.scenario = OptionsOf(flags.scenario);
  }
  options.Validate();
  const auto source = Dataset::Load(options.robot_folder, GuardedReader());
  worldgen::CheckSource(source, options.ProbeFor(*source), !options.scenario);
  const std::string identity = what + options.StanceOptionsText() + ", from " + source->content_hash() + "\n";
  worldgen::DatasetReport report;
  MakeFolder(out, identity, [&](const std::filesystem::path& folder, const worldgen::BuildProgress& progress) {
    report = build(options, folder, progress);
  });
  if (!report.tally.empty()) std::cout << "stances: " << report.tally << "\n";
  return report;
}

void PrintHistograms(const std::vector<worldgen::HistogramRow>& rows) {
  for (const worldgen::HistogramRow& row : rows) {
    std::cout << row.heading << "\n\n";
    for (const worldgen::Histogram& histogram : row.histograms) {
      std::cout << worldgen::FormatHistogram(histogram) << "\n";
    }
  }
}

ExitCode MakeDataset(const DatasetFlags& flags) {
  const worldgen::DatasetReport report = BuildFolder(flags, "", worldgen::BuildDataset);
  PrintHistograms(report.histograms);
  std::cout << "plans: " << report.pairs_tried << " pairs tried, at most " << report.largest_motion
            << " stances per motion\n";
  if (report.one_floor) std::cout << "all motions are on one floor: no two stances are on different floors\n";
  std::cout << "dataset " << report.content_hash << "\n";
  return ExitCode::kOk;
}

/// Refuses options that do not apply to the kind of dataset, as far as their values tell.
void RequireApplicable(const DatasetFlags& flags, bool contacts) {
  const worldgen::DatasetOptions defaults, &given = flags.options;
  const auto refuse = [&](bool used, const std::string& flag) {
    if (!used) return;
    throw ClientError(ExitCode::kUsage, flag + " does not apply to --kind " + flags.scenario.kind + "; leave it out");
  };
  refuse(!contacts && flags.motions != worldgen::ContactDatasetOptions().motions, "--motions");
  refuse(!contacts && flags.traps != worldgen::ContactDatasetOptions().traps, "--traps");
  if (!contacts) return;
  refuse(flags.scenario.level != ScenarioFlags().level, "--level");
  refuse(flags.scenario.no_pictures, "--no-pictures");
  refuse(given.stances != defaults.stances, "--stances");
  refuse(given.same_floor != defaults.same_floor, "--same-floor");
  refuse(given.different_floors.has_value(), "--different-floors");
  refuse(given.certified, "--certified");
  refuse(given.proven.has_value(), "--proven");
  refuse(given.radius_m.has_value(), "--radius");
  refuse(given.slope_rad.has_value(), "--slope");
}

ExitCode MakeContactDataset(const DatasetFlags& flags) {
  worldgen::ContactDatasetOptions options;
  options.name = NameOf(flags);
  options.robot_folder = flags.robot ? std::filesystem::path(*flags.robot) : app::DataFolder() / "hands-small";
  options.seed = flags.scenario.seed;
  options.postures = flags.postures.value_or(options.postures);
  options.motions = flags.motions;
  options.traps = flags.traps;
  options.threads = flags.options.threads;
  options.read_guard = GuardedReader();
  options.Validate();
  const auto source = Dataset::Load(options.robot_folder, GuardedReader());
  const std::string identity = options.Identity() + ", from " + source->content_hash() + "\n";
  worldgen::ContactDatasetReport report;
  MakeFolder(flags.scenario.out, identity,
             [&](const std::filesystem::path& folder, const worldgen::BuildProgress& progress) {
               report = worldgen::BuildContactDataset(options, folder, progress);
             });
  PrintHistograms(report.histograms);
  for (const std::string& line : report.lines) std::cout << line << "\n";
  std::cout << "dataset " << report.content_hash << "\n";
  return ExitCode::kOk;
}

ExitCode MakeCandidates(const DatasetFlags& flags) {
  const worldgen::DatasetReport report = BuildFolder(flags, "candidates, ", worldgen::BuildCandidates);
  std::cout << "dataset " << report.content_hash << "\n";
  return ExitCode::kOk;
}

}  // namespace

void AddGenerateCommand(const app::Command& program, Invocation* invocation) {
  const auto generate = program.AddCommand("generate", "Generate damaged buildings and benchmark problems from a seed");
  generate.RequireCommand();
  generate.LetOptionsFollowCommands();

  const auto scenario = generate.AddCommand("scenario", "Generate a damaged building: mesh, manifest and pictures");
  const auto flags = std::make_shared<ScenarioFlags>();
  AddScenarioFlags(scenario, flags.get(), "garage or house");
  scenario.WhenChosen([=] { invocation->body = [flags] { return GenerateScenario(*flags); }; });

  const auto dataset =
      generate.AddCommand("dataset", "Generate a whole dataset: building, stances, footstep plans and problems");
  const auto dataset_flags = std::make_shared<DatasetFlags>();
  AddScenarioFlags(dataset, &dataset_flags->scenario,
                   "garage, house, or contacts: postures that need hands, or feet on rubble");
  dataset.AddOption("--robot", dataset_flags->robot,
                    "Dataset folder whose robot is used (default: the embedded one's)");
  dataset.AddOption("--motions", dataset_flags->motions, "Motion problems, only of kind contacts").ShowDefault();
  dataset.AddOption("--traps", dataset_flags->traps, "Stances that no forces hold, only of kind contacts")
      .ShowDefault();
  AddInstanceFlags(dataset, dataset_flags.get());
  dataset.WhenChosen([=] {
    invocation->body = [dataset_flags] {
      const bool contacts = dataset_flags->scenario.kind == kContactsKind;
      RequireApplicable(*dataset_flags, contacts);
      return contacts ? MakeContactDataset(*dataset_flags) : MakeDataset(*dataset_flags);
    };
  });

  const auto problems =
      generate.AddCommand("problems", "Generate stances, footstep plans and problems for your robot and scene");
  const auto problem_flags = std::make_shared<DatasetFlags>();
  AddSourceFlags(problems, problem_flags.get());
  AddInstanceFlags(problems, problem_flags.get());
  problems.WhenChosen([=] { invocation->body = [problem_flags] { return MakeDataset(*problem_flags); }; });

  const auto candidates = generate.AddCommand(
      "candidates", "Generate stances of unknown feasibility, as posture problems for the worker pool");
  const auto candidate_flags = std::make_shared<DatasetFlags>();
  AddSourceFlags(candidates, candidate_flags.get());
  AddStanceFlags(candidates, candidate_flags.get());
  candidates.WhenChosen([=] { invocation->body = [candidate_flags] { return MakeCandidates(*candidate_flags); }; });
}

namespace {

struct CertifyFlags {
  std::optional<std::string> dataset;
  std::string out;  // empty: the dataset's folder
  certify::CertifyOptions options;
  TableFormat format = TableFormat::kText;
  OutputOptions output;
};

/// Saves the results at intervals, so that little is lost however the process ends.
class CertificateWriter {
 public:
  CertificateWriter(std::filesystem::path path, const certify::StanceCatalogue& catalogue, const Dataset& dataset)
      : path_(std::move(path)), catalogue_(catalogue), dataset_(dataset) {}

  void WriteIfDue(const certify::Certificate& certificate) {
    constexpr auto kPeriod = std::chrono::seconds(10);
    if (std::chrono::steady_clock::now() - written_ < kPeriod) return;
    Write(certificate);
  }
  void Write(const certify::Certificate& certificate) {
    ReplaceFile(path_, certify::FormatCertificate(certificate, catalogue_, dataset_));
    written_ = std::chrono::steady_clock::now();
  }

 private:
  std::filesystem::path path_;
  const certify::StanceCatalogue& catalogue_;
  const Dataset& dataset_;
  std::chrono::steady_clock::time_point written_ = std::chrono::steady_clock::now();
};

ExitCode Certify(const CertifyFlags& flags) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(flags.dataset, nullptr), GuardedReader());
  const std::filesystem::path out =
      flags.out.empty() ? dataset->folder() / certify::kCertificateFileName : std::filesystem::path(flags.out);
  const files::NameLock lock(out);
  if (!lock.holder().empty()) {
    throw ClientError(ExitCode::kUsage,
                      out.string() + ": " + lock.holder() +
                          " is writing this certificate; wait for that process, or name another --out");
  }
  const certify::StanceCatalogue catalogue(*dataset);
  std::optional<certify::Certificate> known;
  if (std::filesystem::exists(out)) known = certify::ReadCertificate(out, catalogue, *dataset);

  const InterruptGuard guard;
  GenerationProgress progress;
  CertificateWriter writer(out, catalogue, *dataset);
  certify::CertifyHooks hooks;
  hooks.stop = [] { return Interrupted(); };
  hooks.progress = [&](const char* stage, std::size_t done, std::size_t total) {
    progress.Show(stage, static_cast<double>(done), static_cast<double>(total), "stances");
  };
  hooks.on_update = [&](const certify::Certificate& certificate) { writer.WriteIfDue(certificate); };
  const certify::Certificate certificate =
      certify::CertifyDataset(dataset, catalogue, flags.options, known ? &*known : nullptr, hooks);
  progress.Break();
  writer.Write(certificate);
  if (!certificate.IsComplete()) {
    throw ClientError(ExitCode::kInterrupted,
                      "interrupted; the same command continues from the known results in " + out.string());
  }
  const std::string text = RenderFeasibility(certificate, catalogue, *dataset, flags.format, LayoutOf(flags.output));
  Print(flags.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, flags.output);
  return ExitCode::kOk;
}

}  // namespace

void AddCertifyCommand(const app::Command& program, Invocation* invocation) {
  constexpr int kMaxStarts = 10'000'000;
  constexpr int kMaxThreads = 1024;
  const auto command = program.AddCommand(
      "certify", "Find which problems of a dataset are feasible: a posture or a proof for every stance");
  const auto flags = std::make_shared<CertifyFlags>();
  command.AddOption("DATASET", flags->dataset, "Dataset folder (default: the embedded garage-easier)");
  command.AddOption("--out", flags->out,
                    "Certificate to write or to continue (default: certificate.json in the dataset's folder)");
  command.AddOption("--starts", flags->options.starts, "Initial guesses for a stance before it is reported as open")
      .ShowDefault()
      .Check(app::WholeNumber(1, kMaxStarts));
  flags->options.threads = NumProcessors();
  command.AddOption("--threads", flags->options.threads, "Number of threads, same result for any (default: all cores)")
      .Check(app::WholeNumber(1, kMaxThreads));
  AddFormatOption(command, &flags->format);
  AddOutputOptions(command, &flags->output);
  command.WhenChosen([=] { invocation->body = [flags] { return Certify(*flags); }; });
}

}  // namespace legopt::client
