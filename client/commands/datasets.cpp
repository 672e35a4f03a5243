#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/contact_sequences.h"
#include "client/commands/options.h"
#include "client/commands/robot_picture.h"
#include "client/commands/scene_options.h"
#include "client/pool/packed_dataset.h"
#include "client/report/escaped_text.h"
#include "client/report/finding_report.h"
#include "client/report/output.h"
#include "client/sheet/dataset_sheet.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/files/written_file.h"
#include "legopt/import/importer.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/import/internal/self_collision_pairs.h"
#include "legopt/input/json.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

struct DatasetOptions {
  std::optional<std::string> folder;
  bool check = false;
  TableFormat format = TableFormat::kText;
};

ExitCode CheckHashes(const std::filesystem::path& folder, const DatasetOptions& options) {
  const DatasetDescription description = ReadDatasetFile(folder);
  const auto manifest = ComputeManifest(folder, GuardedReader());
  Listing listing;
  listing.columns = {"file", "state", "hash"};
  std::size_t faults = 0;
  for (const auto& file : manifest) {
    const auto expected = description.files.find(file.path);
    std::string fault;
    if (expected == description.files.end())
      fault = "not in the manifest";
    else if (expected->second != file.hash)
      fault = "differs";
    faults += fault.empty() ? 0 : 1;
    listing.rows.push_back({file.path, fault.empty() ? "ok" : fault, file.hash});
  }
  for (const auto& [path, hash] : description.files) {
    const bool used = std::any_of(manifest.begin(), manifest.end(),
                                  [&wanted = path](const FileHash& file) { return file.path == wanted; });
    if (used) continue;
    ++faults;
    listing.rows.push_back({path, "not used by the dataset", hash});
  }
  PrintPlain(listing, options.format);
  if (faults == 0) return ExitCode::kOk;
  throw ClientError(ExitCode::kDatasetMismatch, (folder / kDatasetFileName).string() + ": " + std::to_string(faults) +
                                                    " hashes do not fit the files; 'legopt dataset hash " +
                                                    folder.string() + "' writes them anew");
}

ExitCode Hash(const DatasetOptions& options) {
  const std::filesystem::path folder = *options.folder;
  if (options.check) return CheckHashes(folder, options);
  Listing listing;
  listing.columns = {"file", "hash"};
  for (const auto& file : WriteManifestHashes(folder, GuardedReader())) listing.rows.push_back({file.path, file.hash});
  PrintPlain(listing, options.format);
  std::cerr << "dataset " << Dataset::Load(folder, GuardedReader())->content_hash() << "\n";
  return ExitCode::kOk;
}

// Returns the degrees of freedom in the order of solution vectors; missing limits are null.
Listing JointListing(const RobotModel& robot) {
  Listing listing;
  listing.columns = {"index", "joint", "type", "lower", "upper", "unit"};
  const auto limit = [](double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); };
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))];
    listing.rows.push_back({dof, joint.name, std::string(ToString(joint.type)), limit(joint.lower), limit(joint.upper),
                            std::string(UnitOf(joint.type))});
  }
  return listing;
}

std::string OrderNote(const RobotModel& robot) {
  const auto range = [](int first, int last) { return std::to_string(first) + "-" + std::to_string(last); };
  const int position = robot.base_position_index(), rotation = robot.base_rotation_index();
  return "Order of x: these joints, then the base: position x y z (" + range(position, rotation - 1) +
         ", m), quaternion w x y z (" + range(rotation, robot.configuration_size() - 1) + ").";
}

// CSV contains one table, as for every command; the other formats include the joints.
std::string RenderInfo(const Listing& listing, const RobotModel& robot, TableFormat format) {
  if (format == TableFormat::kCsv) return CsvFor(StandardOutput(), RenderListing(listing, format));
  const Listing joints = JointListing(robot);
  if (format == TableFormat::kJson) {
    nlohmann::ordered_json json = ListingToJson(listing);
    json[0]["joints"] = ListingToJson(joints);
    return Dump(json, 2) + "\n";
  }
  Table order = TableOf(joints);
  order.notes = {{OrderNote(robot)}};
  return RenderTables({TableOf(listing), order}, format);
}

/// Adds the link pairs of a dataset that lists those that are not compared.
template <class Add>
void AddPairCounts(const Dataset& dataset, const Add& add) {
  if (!dataset.unchecked_pairs()) return;
  const PairCounts counts = CountPairs(dataset);
  add("compared_pairs", counts.checked);
  for (const EnumName<UncheckedReason>& row : kEnumNames<UncheckedReason>) {
    add(std::string(row.word) + "_pairs", counts.unchecked[row.value]);
  }
}

ExitCode Info(const DatasetOptions& options) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.folder, nullptr), GuardedReader());
  Listing listing;
  auto& row = listing.rows.emplace_back();
  const auto add = [&](const std::string& column, nlohmann::json cell) {
    listing.columns.push_back(column);
    row.push_back(std::move(cell));
  };
  add("name", dataset->name());
  add("folder", dataset->folder().string());
  add("robot", dataset->robot().name());
  add("dofs", dataset->robot().num_dofs());
  add("mass_kg", dataset->robot().total_mass());
  add("scene_objects", dataset->scene().objects.size());
  for (const TaskDescription& of : ProblemTasks()) {
    add(std::string(ToString(of.task)) + "_problems", dataset->problems(of.task).size());
  }
  AddPairCounts(*dataset, add);
  add("hash", dataset->content_hash());
  std::cout << RenderInfo(listing, dataset->robot(), options.format);
  return ExitCode::kOk;
}

struct PackOptions {
  std::string folder;
  std::string out = ".";
};

ExitCode Pack(const PackOptions& options) {
  std::cout << app::Printable(PackInto(app::NamedDatasetFolder(options.folder), options.out).archive.string()) << "\n";
  return ExitCode::kOk;
}

struct SheetOptions {
  std::optional<std::string> folder;
  std::optional<std::string> out;
};

ExitCode Sheet(const SheetOptions& options) {
  const std::string text = DatasetSheet(*Dataset::Load(ChooseDatasetFolder(options.folder, nullptr), GuardedReader()));
  if (options.out) {
    ReplaceFile(*options.out, text);
  } else {
    std::cout << text;
  }
  return ExitCode::kOk;
}

struct CheckOptions {
  std::optional<std::string> folder;
  bool json = false;
};

ExitCode Check(const CheckOptions& options) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.folder, nullptr), GuardedReader());
  const std::vector<DatasetDiagnostic> findings = CheckDataset(*dataset);
  if (options.json) {
    std::cout << JsonText(DatasetFindingsToJson(findings)) << "\n";
  } else {
    std::cout << RenderTable(TableOf(findings), TableFormat::kText, LayoutOf({}));
  }
  if (!AnyError(findings)) return ExitCode::kOk;
  throw ClientError(ExitCode::kUsage, dataset->folder().string() +
                                          ": the dataset has faults with which results would "
                                          "mean nothing (marked FAIL)");
}

}  // namespace

void AddDatasetCommand(const app::Command& program, Invocation* invocation) {
  const auto dataset =
      program.AddCommand("dataset", "Check, hash, describe and pack datasets; exchange contact sequences");
  dataset.RequireCommand();
  dataset.LetOptionsFollowCommands();

  const auto hash = dataset.AddCommand("hash", "Write the content hashes of all files into dataset.yaml");
  const auto options = std::make_shared<DatasetOptions>();
  hash.AddOption("DIR", options->folder, "Dataset folder").Required();
  hash.AddFlag("--check", options->check, "Only compare; exit code 5 when a hash does not fit");
  AddFormatOption(hash, &options->format);
  hash.WhenChosen([=] { invocation->body = [options] { return Hash(*options); }; });

  const auto check = dataset.AddCommand("check", "Check winding, quaternions, footholds and starts of a dataset");
  const auto check_options = std::make_shared<CheckOptions>();
  check.AddOption("DIR", check_options->folder, "Dataset folder (default: the embedded garage-easier)");
  AddTextOrJsonOption(check, &check_options->json);
  check.WhenChosen([=] { invocation->body = [check_options] { return Check(*check_options); }; });

  const auto pack =
      dataset.AddCommand("pack", "Pack a dataset into one file, which 'legopt-server --datasets' sends to workers");
  const auto pack_options = std::make_shared<PackOptions>();
  pack.AddOption("DIR", pack_options->folder, "Dataset folder").Required();
  pack.AddOption("--out", pack_options->out, "Folder to write it to, as HASH.legopt-dataset").ShowDefault();
  pack.WhenChosen([=] { invocation->body = [pack_options] { return Pack(*pack_options); }; });

  const auto sheet = dataset.AddCommand(
      "sheet", "Write a data sheet in Markdown: problems, contacts, features, origin, proofs, tolerances");
  const auto sheet_options = std::make_shared<SheetOptions>();
  sheet.AddOption("DIR", sheet_options->folder, "Dataset folder (default: the embedded garage-easier)");
  sheet.AddOption("--out", sheet_options->out, "File to write (default: standard output)");
  sheet.WhenChosen([=] { invocation->body = [sheet_options] { return Sheet(*sheet_options); }; });

  const auto info = dataset.AddCommand(
      "info", "Load a dataset, check its hashes and describe it, with its joints in the order of solutions");
  const auto info_options = std::make_shared<DatasetOptions>();
  info.AddOption("DIR", info_options->folder, "Dataset folder (default: the embedded garage-easier)");
  AddFormatOption(info, &info_options->format);
  info.WhenChosen([=] { invocation->body = [info_options] { return Info(*info_options); }; });

  AddSequenceCommands(dataset, invocation);
}

namespace {

struct Flags {
  ImportOptions options;
  std::string out;
  std::vector<std::string> nominal, mesh_path;
  SceneFlags scene;
  bool repair = false;
  bool fix_winding = false;  ///< has no effect: bodies are turned anyway
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

std::string StandingLine(const StandingProof& standing) {
  constexpr double kMillimetres = 1e3, kMilliseconds = 1e3;
  return "the robot stands, with its centre of mass " +
         FormatFixed(kMillimetres * std::max(0.0, standing.com_margin_m), 0) +
         " mm inside the support polygon; solved in " + FormatFixed(kMilliseconds * standing.solve_s, 1) +
         " ms; picture: robot.png";
}

void PrintReport(const ImportReport& report, const std::string& out, bool json) {
  if (json) {
    nlohmann::ordered_json document = {{"dataset", out},
                                       {"hash", report.content_hash},
                                       {"written", !AnyError(report.findings)},
                                       {"findings", DatasetFindingsToJson(report.findings)}};
    if (report.standing) {
      document["standing"] = {{"stands", report.standing->proof.stands},
                              {"com_margin_m", report.standing->proof.com_margin_m},
                              {"solve_s", report.standing->proof.solve_s}};
    }
    if (!report.scene.empty()) document["repairs"] = RepairsToJson(report.scene);
    std::cout << JsonText(document) << "\n";
    return;
  }
  std::cout << RenderTable(TableOf(report.findings), TableFormat::kText, LayoutOf({}));
  if (AnyError(report.findings)) return;
  if (report.standing) std::cout << StandingLine(report.standing->proof) << "\n";
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
    copies.push_back(std::make_unique<RereadableFile>(*file, files::FolderForTemporaryFiles()));
    file = copies.back()->path().string();
  }
  return copies;
}

/// Returns a folder's name with '-' for each character that a dataset's name must not contain.
std::string NameOf(std::string folder) {
  std::ranges::replace_if(
      folder, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; }, '-');
  return folder;
}

/// Asks at the terminal.
std::vector<std::string> AskContacts(const std::vector<std::string>& ends) {
  std::cerr << "Which links touch the ground? Ends of the robot, lowest first:\n";
  for (std::size_t i = 0; i < ends.size(); ++i) std::cerr << "  " << i + 1 << "  " << app::Printable(ends[i]) << '\n';
  std::cerr << "Numbers or links, separated by commas (none: stop): " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  std::vector<std::string> words = app::SplitValues(answer);
  std::erase(words, "");
  return words;
}

ExitCode Import(const Flags& flags) {
  ImportOptions options = flags.options;
  if (!flags.json && ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1) options.ask_contacts = AskContacts;
  options.scene = flags.scene.Options();
  options.scene.repair = flags.repair;
  if (!flags.repair && (flags.scene.weld_m || flags.scene.thickness_m)) {
    throw InputError(
        {"", flags.scene.weld_m ? "--weld" : "--thickness", "", "is an option of a repair", "give --repair as well"});
  }
  options.read_guard = GuardedReader();
  for (const std::string& word : flags.nominal) AddNominal(word, &options);
  for (const std::string& folder : flags.mesh_path) {
    if (!std::filesystem::is_directory(folder)) {
      throw InputError({"", "--mesh-path", folder, "no such folder", "name the folder that holds the meshes"});
    }
    options.meshes.folders.emplace_back(folder);
  }
  const std::filesystem::path out = std::filesystem::path(flags.out).lexically_normal();
  if (options.name.empty()) options.name = NameOf((out.has_filename() ? out : out.parent_path()).filename().string());
  options.Validate();
  const std::vector<std::unique_ptr<RereadableFile>> copies = MakeProblemsRereadable(options);
  StagedFolder folder(out, "import of " + options.source.string() + "\n", Unfinished::kRemoved);
  ImportReport report;
  try {
    report = ImportDataset(options, folder.path());
    if (report.standing) WriteRobotPicture(report.standing->view, folder.path() / "robot.png");
    if (flags.repair) WriteRepairPicture(report.scene, (folder.path() / "scene-repairs.png").string());
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
  command.AddOption("DIR", options.source, "Folder with the files, or a robot's file (URDF or COLLADA)").Required();
  command.AddOption("--out", flags->out, "Folder to make; it must not exist").Required();
  command.AddOption("--name", options.name, "Name of the dataset (default: name of the --out folder)");
  command.AddOption("--robot", options.files.robot, "URDF, or COLLADA with kinematics (default: the only one)");
  command.AddOption("--scene", options.files.scene,
                    "Mesh, scene.yaml or Gazebo world (default: scene.yaml, else the only mesh)");
  for (const TaskDescription& task : ProblemTasks()) {
    command.AddOption("--" + std::string(ToString(task.task)), options.files.problems[task.task],
                      std::string(task.short_title) + " problems (default: problems*.json of that task)");
  }
  command.AddList("--contacts,--feet", options.contacts,
                  "Links that may carry the robot, or numbers from the list that an import without this option prints "
                  "(default: those in the problems, else the lowest ends of the robot)");
  command.AddOption("--trunk", options.trunk,
                    "Link from which heights and reach are measured (default: found, in the body that the legs carry)");
  command.AddOption("--sole-offset", options.sole_offset_m,
                    "Height of the feet's link frames above their target poses in m, for feet with parallel frames "
                    "(default: soles are measured)");
  command.AddList(
      "--nominal", flags->nominal,
      "Start of every solve, JOINT=RADIANS, comma separated (default: a posture with bent legs is searched)");
  command.AddFlagAction(
      "--no-proof", [flags] { flags->options.prove = false; }, "Import a robot without a proof that it can stand");
  command.AddOption("--self-collision-samples", options.self_collision_samples,
                    "Number of postures that decide which link pairs are compared (default: 10000; 0: pairs that touch "
                    "with all joints at 0 are not)");
  command.AddOption("--self-collision-seed", options.self_collision_seed, "Seed of these postures").ShowDefault();
  command.AddFlag("--collision-from-visual", options.collision_from_visual,
                  "Use the visual geometry of links without collision geometry");
  command.AddList("--mesh-path", flags->mesh_path, "Folders in which the robot's meshes are searched, too");
  command.AddFlag("--allow-missing-meshes", options.meshes.allow_missing, "Leave meshes out whose files do not exist");
  command.AddOption("--mesh-scale", options.mesh_scale,
                    "Factor for all meshes of the robot, 0.001 for millimetres (default: 1)");
  command.AddFlag("--repair", flags->repair,
                  "Repair the scene's meshes like 'legopt scene repair'; scene-repairs.png shows what was added");
  AddSceneOptions(command, &flags->scene);
  command.AddFlag("--fix-winding", flags->fix_winding,
                  "No effect any more: inverted bodies of the scene are always turned");
  AddTextOrJsonOption(command, &flags->json);
  command.SetFooter(
      "Files without an option are searched in DIR: those of its dataset.yaml; else the only URDF (else the only "
      "COLLADA\n"
      "robot), the scene of an OpenRAVE environment *.xml, scene.yaml or the only mesh, and problems*.json, one per "
      "task.\n"
      "Faults of the scene that need no new surface (vertices not welded, duplicates, winding) are repaired always.\n"
      "The scene is in metres, z up; quaternions have norm 1, their order is found out. DIR is not changed;\n"
      "faults marked FAIL make no dataset, exit code 2. A robot's file in place of DIR is read with its meshes and "
      "SRDF.");
  command.WhenChosen([=] { invocation->body = [flags] { return Import(*flags); }; });
}

}  // namespace legopt::client
