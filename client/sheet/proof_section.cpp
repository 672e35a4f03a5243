#include "client/sheet/proof_section.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "app/folder_cache.h"
#include "client/report/escaped_text.h"
#include "client/report/push_report.h"
#include "client/sheet/feature_file.h"
#include "client/sheet/sheet_text.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/input/json.h"
#include "legopt/judge/solution_file.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

/// Counts of stances by evidence, and the reasons of proofs.
std::string StanceCounts(const certify::Certificate& certificate) {
  EnumArray<Feasibility, int> counts{};
  std::set<std::string> proofs;
  for (const std::optional<certify::StanceEvidence>& evidence : certificate.stances) {
    if (!evidence) continue;
    ++counts[evidence->feasibility];
    if (evidence->feasibility == Feasibility::kInfeasible) proofs.insert(evidence->proof);
  }
  std::string text = "Different stances: " + std::to_string(certificate.stances.size()) + ", of which " +
                     std::to_string(counts[Feasibility::kCertified]) + " have a posture in the file, " +
                     std::to_string(counts[Feasibility::kInfeasible]) + " a proof that there is none, and " +
                     std::to_string(counts[Feasibility::kOpen]) + " neither.\n\n";
  for (const std::string& proof : proofs) text += "* proof: " + MarkdownText(app::Printable(proof)) + "\n";
  return text + (proofs.empty() ? "" : "\n");
}

std::string CertificateText(const Dataset& dataset) {
  const fs::path path = dataset.folder() / certify::kCertificateFileName;
  if (!fs::exists(path)) {
    return "Without `certificate.json`, the feasibility of the problems is not known. `legopt certify DATASET` "
           "searches "
           "for it.\n\n";
  }
  const certify::StanceCatalogue catalogue(dataset);
  const certify::Certificate certificate = certify::ReadCertificate(path, catalogue, dataset);
  SheetTable table{{"task", "problems", "certified", "infeasible", "open"}, {}};
  for (const TaskDescription& task : ProblemTasks()) {
    if (dataset.problems(task.task).empty()) continue;
    const auto counts = certify::CountProblems(certificate, catalogue, task.task);
    table.rows.push_back({std::string(ToString(task.task)), std::to_string(dataset.problems(task.task).size()),
                          std::to_string(counts[Feasibility::kCertified]),
                          std::to_string(counts[Feasibility::kInfeasible]),
                          std::to_string(counts[Feasibility::kOpen])});
  }
  return std::string("Feasibility by `certificate.json`") + (certificate.IsComplete() ? "" : ", which is incomplete") +
         ":\n\n" + FormatSheetTable(table) +
         "* certified: the file has a posture of every stance that the judge accepts by the literal and the strict "
         "rule\n"
         "* infeasible: a proof excludes every posture of a stance\n"
         "* open: neither\n\n" +
         StanceCounts(certificate);
}

/// Pushes that planted postures resist.
std::string PushText(const Dataset& dataset, const SolutionFile& file) {
  const Listing pushes = SummaryOf(PushSolutions(file, dataset, 1));
  SheetTable table{pushes.columns, {}};
  for (const std::vector<nlohmann::json>& cells : pushes.rows) {
    std::vector<std::string>& row = table.rows.emplace_back();
    for (const nlohmann::json& cell : cells) {
      row.push_back(cell.is_number() ? SheetNumber(cell.get<double>())
                    : cell.is_null() ? "-"
                                     : cell.get<std::string>());
    }
  }
  if (table.rows.empty()) return {};
  return "Success of planted postures by the physical rule, shares of effort limits, and pushes that they resist "
         "within "
         "friction and effort limits, N and in weights of the robot, and by contact forces alone, N; `legopt evaluate "
         "FILE --dataset DATASET --pushes problems` prints each:\n\n" +
         FormatSheetTable(table);
}

/// Planted solutions, which `legopt evaluate` judges.
std::string PlantedText(const Dataset& dataset) {
  std::string text, pushes;
  for (const TaskDescription& task : ProblemTasks()) {
    const std::string name = "solutions-" + std::string(ToString(task.task)) + ".json";
    const fs::path path = dataset.folder() / name;
    if (!fs::exists(path)) continue;
    const SolutionFile file = ReadSolutions(path);
    const auto solved =
        std::ranges::count_if(file.problems, [](const SolvedProblem& problem) { return !problem.solutions.empty(); });
    text += "* `" + name + "`: solutions of " + std::to_string(solved) + " problems, judged as task `" +
            std::string(ToString(file.task)) + "`\n";
    if (!DescriptionOf(file.task).windowed) pushes += PushText(dataset, file);
  }
  return text.empty()
             ? ""
             : "Planted solutions; `legopt evaluate FILE --dataset DATASET` judges them:\n\n" + text + "\n" + pushes;
}

std::string FeetAloneText(const Dataset& dataset) {
  const fs::path path = dataset.folder() / "features.csv";
  if (!fs::exists(path)) return {};
  const FeatureFile features = ReadFeatures(path);
  std::string text;
  for (const std::string& word : features.Words("feet_alone")) {
    text += "* " + MarkdownText(app::Printable(word)) + ": " + std::to_string(features.Count({{"feet_alone", word}})) +
            " problems\n";
  }
  if (text.empty()) return {};
  return "Whether feet alone can hold the posture problems, by the column `feet_alone` of `features.csv`:\n\n" + text +
         "\nSlide: no forces within friction hold the feet, even with more friction by `friction_margin` of "
         "`generation.json`. Reach: the centre of mass cannot be where the feet would balance it. Both hold for every "
         "posture.\n\n";
}

/// Returns true if the stored direction proves that the stance slides.
bool Holds(const Dataset& traps, int id, const nlohmann::json& proof, const nlohmann::json& file) {
  std::vector<TouchedSurface> surfaces = SurfacesOf(traps, traps.problem(Task::kPosture, id).stances.front());
  for (TouchedSurface& surface : surfaces) surface.friction += file.at("friction_margin").get<double>();
  const bool circumscribed = file.at("pyramid") == "circumscribed";
  const StanceForces forces(surfaces, circumscribed ? FrictionPyramid::kCircumscribed : FrictionPyramid::kInscribed);
  const nlohmann::json& direction = proof.at("direction");
  return IsProof(CheckedProof(
      forces, {direction.at(0).get<double>(), direction.at(1).get<double>(), direction.at(2).get<double>()},
      proof.at("turn").get<double>()));
}

std::string TrapText(const Dataset& dataset) {
  const fs::path folder = dataset.folder() / "traps", path = folder / "proofs.json";
  if (!fs::exists(folder / kDatasetFileName) || !fs::exists(path)) return {};
  const auto traps = Dataset::Load(folder, GuardedReader());
  const nlohmann::json file = ReadJsonFile(path);
  int proven = 0;
  try {
    for (const nlohmann::json& proof : file.at("proofs")) proven += Holds(*traps, proof.at("id"), proof, file) ? 1 : 0;
    return "`traps/` is a dataset of " + std::to_string(traps->problems(Task::kPosture).size()) +
           " posture problems that no forces hold (content hash `" + traps->content_hash() + "`). " +
           std::to_string(proven) + " of the " + std::to_string(file.at("proofs").size()) +
           " proofs of `proofs.json` hold when this page is made: for friction above the declared one by " +
           SheetNumber(file.at("friction_margin")) + ", and a pyramid that is " +
           file.at("pyramid").get<std::string>() + " about the friction cone.\n\n";
  } catch (const nlohmann::json::exception& error) {
    throw InputError({path.string(), "proofs", "", "is not a list of proofs (" + std::string(error.what()) + ")",
                      "restore the file, or remove it"});
  }
}

}  // namespace

std::string ProofSection(const Dataset& dataset) {
  return SheetSection("Proofs",
                      CertificateText(dataset) + PlantedText(dataset) + FeetAloneText(dataset) + TrapText(dataset));
}

}  // namespace legopt::client
