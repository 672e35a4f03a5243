#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/finding_report.h"
#include "client/report/json_text.h"
#include "client/report/terminal.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/text_file.h"
#include "legopt/files/written_file.h"
#include "legopt/import/importer.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

struct Flags {
  ImportOptions options;
  std::string out;
  std::vector<std::string> nominal;
  bool json = false;
};

/// Parses JOINT=NUMBER.
void AddNominal(const std::string& word, ImportOptions* options) {
  const size_t equals = word.find('=');
  double value = 0.0;
  const char* end = word.data() + word.size();
  const char* begin = equals == std::string::npos ? end : word.data() + equals + 1;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (begin == end || error != std::errc() || stop != end) {
    throw InputError({"", "--nominal", word, "is not JOINT=RADIANS", "e.g. --nominal l_knee=0.9"});
  }
  options->nominal_posture[word.substr(0, equals)] = value;
}

void PrintReport(const ImportReport& report, const std::string& out, bool json) {
  if (json) {
    const nlohmann::ordered_json document = {{"dataset", out},
                                             {"hash", report.content_hash},
                                             {"written", !AnyError(report.findings)},
                                             {"findings", DatasetFindingsToJson(report.findings)}};
    std::cout << JsonText(document) << "\n";
    return;
  }
  std::cout << RenderTable(TableOf(report.findings), TableFormat::kText, LayoutOf({}));
  if (!AnyError(report.findings))
    std::cout << "dataset " << report.content_hash << " in " << app::Printable(out) << "\n";
}

// Problem files are read twice: once to check them and once to copy them.
std::vector<std::unique_ptr<RereadableFile>> MakeProblemsRereadable(ImportOptions& options) {
  std::vector<std::filesystem::path> names;
  for (const TaskDescription& task : ProblemTasks()) names.emplace_back(options.files.problems[task.task].value_or(""));
  RequireOneStandardInput(names);
  std::vector<std::unique_ptr<RereadableFile>> copies;
  for (const TaskDescription& task : ProblemTasks()) {
    auto& file = options.files.problems[task.task];
    if (!file || !files::IsStream(InputFile(*file))) continue;
    copies.push_back(std::make_unique<RereadableFile>(*file, std::filesystem::temp_directory_path()));
    file = copies.back()->path().string();
  }
  return copies;
}

ExitCode Import(const Flags& flags) {
  ImportOptions options = flags.options;
  options.read_guard = CallIsolated;
  for (const std::string& word : flags.nominal) AddNominal(word, &options);
  const std::filesystem::path out = std::filesystem::path(flags.out).lexically_normal();
  if (options.name.empty()) options.name = (out.has_filename() ? out : out.parent_path()).filename().string();
  options.Validate();
  const std::vector<std::unique_ptr<RereadableFile>> copies = MakeProblemsRereadable(options);
  StagedFolder folder(out, "import of " + options.source.string() + "\n", Unfinished::kRemoved);
  ImportReport report;
  try {
    report = ImportDataset(options, folder.path());
    if (!AnyError(report.findings)) folder.Finish();
  } catch (const InputError& error) {
    folder.Discard();
    throw WithGivenNames(error, copies);
  } catch (...) {
    folder.Discard();
    throw;
  }
  PrintReport(report, out.string(), flags.json);
  if (!AnyError(report.findings)) return ExitCode::kOk;
  folder.Discard();
  throw ClientError(ExitCode::kUsage, options.source.string() +
                                          ": the files have faults with which results would mean "
                                          "nothing (marked FAIL); no dataset was made");
}

}  // namespace

void AddImportCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand(
      "import", "Make and check a dataset from robot, scene and problem files, e.g. a clone of the original benchmark");
  const auto flags = std::make_shared<Flags>();
  ImportOptions& options = flags->options;
  command.AddOption("DIR", options.source, "Folder with the files").Required();
  command.AddOption("--out", flags->out, "Folder to make; it must not exist").Required();
  command.AddOption("--name", options.name, "Name of the dataset (default: that of the folder)");
  command.AddOption("--robot", options.files.robot, "URDF, or COLLADA with kinematics (default: the only one)");
  command.AddOption("--scene", options.files.scene, "Mesh or scene.yaml (default: scene.yaml, else the only mesh)");
  for (const TaskDescription& task : ProblemTasks()) {
    command.AddOption("--" + std::string(ToString(task.task)), options.files.problems[task.task],
                      std::string(task.short_title) + " problems (default: problems*.json of that task)");
  }
  command.AddList("--feet", options.feet, "Links that may carry the robot (default: those in the problems)");
  command.AddOption(
      "--sole-offset", options.sole_offset_m,
      "Height of a foot's link frame above its target pose in m (default: lowest point of the feet plus 1 mm)");
  command.AddList("--nominal", flags->nominal,
                  "Start of every solve, JOINT=RADIANS, comma separated (default: all joints 0)");
  command.AddFlag("--fix-winding", options.fix_winding, "Flip inverted bodies of the scene");
  AddTextOrJsonOption(command, &flags->json);
  command.SetFooter(
      "Files without an option are searched in DIR: those of its dataset.yaml; else the only URDF (else the only "
      "COLLADA\n"
      "robot), the scene of an OpenRAVE environment *.xml, scene.yaml or the only mesh, and problems*.json, one per "
      "task.\n"
      "The scene is in metres, z up; quaternions have norm 1, their order is found out. DIR is not changed;\n"
      "faults marked FAIL make no dataset, exit code 2.");
  command.WhenChosen([=] { invocation->body = [flags] { return Import(*flags); }; });
}

}  // namespace legopt::client
