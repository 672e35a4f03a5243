#include "legopt/dataset/dataset.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/pool/packed_dataset.h"
#include "client/report/finding_report.h"
#include "client/report/json_text.h"
#include "client/report/terminal.h"
#include "client/suite/chosen_files.h"
#include "legopt/dataset/content_hash.h"
#include "legopt/dataset/dataset_file.h"
#include "legopt/import/dataset_check.h"
#include "legopt/input/json.h"
#include "legopt/robot/dof_names.h"

namespace legopt::client {
namespace {

struct DatasetOptions {
  std::optional<std::string> folder;
  bool check = false;
  TableFormat format = TableFormat::kText;
};

ExitCode CheckHashes(const std::filesystem::path& folder, const DatasetOptions& options) {
  const DatasetDescription description = ReadDatasetFile(folder);
  const auto manifest = ComputeManifest(folder, CallIsolated);
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
  for (const auto& file : WriteManifestHashes(folder, CallIsolated)) listing.rows.push_back({file.path, file.hash});
  PrintPlain(listing, options.format);
  std::cerr << "dataset " << Dataset::Load(folder, CallIsolated)->content_hash() << "\n";
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

ExitCode Info(const DatasetOptions& options) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.folder, nullptr), CallIsolated);
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
  add("hash", dataset->content_hash());
  std::cout << RenderInfo(listing, dataset->robot(), options.format);
  return ExitCode::kOk;
}

struct PackOptions {
  std::string folder;
  std::string out = ".";
};

ExitCode Pack(const PackOptions& options) {
  std::cout << app::Printable(PackInto(options.folder, options.out).archive.string()) << "\n";
  return ExitCode::kOk;
}

struct CheckOptions {
  std::optional<std::string> folder;
  bool json = false;
};

ExitCode Check(const CheckOptions& options) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.folder, nullptr), CallIsolated);
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
  const auto dataset = program.AddCommand("dataset", "Check, hash, pack and download datasets");
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

  const auto info = dataset.AddCommand(
      "info", "Load a dataset, check its hashes and describe it, with its joints in the order of solutions");
  const auto info_options = std::make_shared<DatasetOptions>();
  info.AddOption("DIR", info_options->folder, "Dataset folder (default: the embedded garage-easier)");
  AddFormatOption(info, &info_options->format);
  info.WhenChosen([=] { invocation->body = [info_options] { return Info(*info_options); }; });
}

}  // namespace legopt::client
