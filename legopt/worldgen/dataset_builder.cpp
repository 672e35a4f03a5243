#include "legopt/worldgen/dataset_builder.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/solution_file.h"
#include "legopt/math/parallel.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/generation_record.h"
#include "legopt/worldgen/internal/posture_selection.h"
#include "legopt/worldgen/internal/seeds.h"
#include "legopt/worldgen/internal/stance_probe.h"
#include "legopt/worldgen/internal/stance_sampler.h"

namespace legopt::worldgen {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGenerationFile = "generation.json";
constexpr const char* kSolutionsFile = "solutions-posture.json";
constexpr int kCertifierInitialGuesses = 200;  // number of initial guesses per stance before its plan is rejected

/// Posture problem and its proof.
struct Proven {
  Stance stance;
  PostureProof proof;
};

/// Returns the name of the file with the plans that were tried; it depends on the kind of plans and on the criterion
/// for accepting them.
std::string PlansFileName(FloorChange change, bool certified) {
  return (certified ? "certified-plans-" : "plans-") + std::string(ToString(change)) + ".json";
}

/// Makes posture problems, numbered in the order of the stances.
std::vector<ProblemDefinition> AsProblems(const std::vector<Stance>& stances) {
  std::vector<ProblemDefinition> problems;
  for (const Stance& stance : stances) problems.push_back({static_cast<int>(problems.size()), {stance}});
  return problems;
}

class Builder {
 public:
  Builder(const DatasetOptions& options, fs::path folder, const BuildProgress& progress)
      : options_(options), folder_(std::move(folder)), progress_(progress) {}

  DatasetReport Build() {
    PrepareModel();
    const std::vector<Stance> stances = Stances();
    Plan(stances);
    SelectPostures();
    Describe();
    FinishPostures();
    Finish();
    return std::move(report_);
  }

  DatasetReport BuildCandidates() {
    PrepareModel();
    WriteProblems(kStanceTask, AsProblems(Sample(false)));
    Finish();
    return std::move(report_);
  }

 private:
  void Show(const std::string& stage, double done, double total, const std::string& unit) const {
    if (progress_) progress_(stage, done, total, unit);
  }
  void PrepareFolder();
  void PrepareModel();
  void MakeScene();
  std::vector<Stance> Stances();
  std::vector<Stance> Sample(bool prove);
  std::string Format(Task task, std::span<const ProblemDefinition> problems) const;
  void WriteProblems(Task task, std::span<const ProblemDefinition> problems) const;
  DatasetOptions WithFloors(const std::vector<Stance>& stances);
  void Plan(const std::vector<Stance>& stances);
  std::function<bool(int, const FootstepPlan&)> PlanCheck() const;
  void SelectPostures();
  std::vector<Stance> UniqueStances() const;
  std::vector<StanceFeatures> Features(const std::vector<Stance>& stances) const;
  void Describe();
  void DescribePlans(const std::vector<std::pair<FloorChange, PlannedPair>>& tried) const;
  void FinishPostures() const;
  void Finish();
  void Certify() const;

  const DatasetOptions& options_;
  fs::path folder_;
  const BuildProgress& progress_;
  std::shared_ptr<const Dataset> dataset_;
  std::shared_ptr<const ProbeModel> model_;
  Eigen::AlignedBox2d region_;
  std::string scenario_name_;  // written to problem files; not the dataset's name, which affects no result
  std::vector<ProblemDefinition> motions_;
  std::vector<Proven> postures_;
  DatasetReport report_;
};

void Builder::MakeScene() {
  if (fs::exists(folder_ / kScenarioFileName)) return;
  const Scenario scenario =
      MakeScenario(*options_.scenario, [&](double done, double total) { Show("collapse", done, total, "s"); });
  WriteScenario(scenario, folder_, options_.pictures, options_.read_guard);
}

/// Writes a dataset without problems, so that it can be loaded.
void Builder::PrepareFolder() {
  const auto source = Dataset::Load(options_.robot_folder, options_.read_guard);
  DatasetDescription description = DescribeDataset(options_.robot_folder);
  CopyRobot(*source, description, folder_);
  if (options_.scenario) {
    MakeScene();
    description.scene_file = kSceneMeshName;
    scenario_name_ =
        std::string(ToString(options_.scenario->kind)) + "-" + std::string(ToString(options_.scenario->level));
    const Building building = MakeBuilding(options_.scenario->kind, DeriveSeed(options_.scenario->seed, "building"));
    constexpr double kMargin_m = 1.0;
    region_ = building.plan;
    region_.min().array() -= kMargin_m;
    region_.max().array() += kMargin_m;
  } else {
    CopyScene(*source, description, folder_);
    scenario_name_ = source->name();
  }
  description.name = options_.name;
  for (const TaskDescription& task : ProblemTasks()) description.problem_files[task.task] = task.problem_file;
  WriteTextFile(folder_ / kDatasetFileName,
                FormatDatasetFile(description, "Made by `legopt generate`; " + options_.Identity()));
  for (const TaskDescription& task : ProblemTasks()) {
    WriteTextFile(folder_ / task.problem_file, FormatProblems({}, task.task, source->robot().name(), scenario_name_));
  }
  WriteManifestHashes(folder_, options_.read_guard);
}

void Builder::PrepareModel() {
  PrepareFolder();
  dataset_ = Dataset::Load(folder_, options_.read_guard);
  RequireClosedMeshes(*dataset_);
  RequireLeftFootFirst(*dataset_);
  model_ = ProbeModel::Build(dataset_, options_.ProbeFor(*dataset_), options_.seed);
  WriteTextFile(folder_ / kGenerationFile, DescribeGeneration(options_, model_->options, PlannerOptions{}));
}

std::vector<Stance> Builder::Stances() {
  const fs::path path = folder_ / kStancesFileName;
  std::vector<Stance> stances;
  if (fs::exists(path)) {
    for (const ProblemDefinition& problem : ReadProblemFile(path).problems) stances.push_back(problem.stances.front());
    return stances;
  }
  stances = options_.proven ? ReadFeasibleStances(dataset_, *options_.proven) : Sample(true);
  WriteTextFile(path, Format(kStanceTask, AsProblems(stances)));
  return stances;
}

std::vector<Stance> Builder::Sample(bool prove) {
  StanceSamplerOptions sampler;
  sampler.count = options_.stances;
  sampler.seed = options_.seed;
  sampler.region = region_;
  sampler.threads = options_.threads;
  sampler.prove = prove;
  Show("stances", 0, sampler.count, "stances");
  SampledStances sampled =
      SampleStances(model_, sampler, [&](int done, int total) { Show("stances", done, total, "stances"); });
  report_.tally = sampled.tally.Describe();
  return std::move(sampled.stances);
}

std::string Builder::Format(Task task, std::span<const ProblemDefinition> problems) const {
  return FormatProblems(problems, task, dataset_->robot().name(), scenario_name_);
}

void Builder::WriteProblems(Task task, std::span<const ProblemDefinition> problems) const {
  WriteTextFile(folder_ / DescriptionOf(task).problem_file, Format(task, problems));
}

/// Returns a function that checks that every stance of a plan has a posture; empty if certified plans are not
/// requested.
std::function<bool(int, const FootstepPlan&)> Builder::PlanCheck() const {
  if (!options_.certified) return {};
  auto certifiers = std::make_shared<std::vector<std::unique_ptr<certify::StanceCertifier>>>();
  for (int k = 0; k < options_.threads; ++k)
    certifiers->push_back(std::make_unique<certify::StanceCertifier>(dataset_));
  return [certifiers](int worker, const FootstepPlan& plan) {
    certify::StanceCertifier& certifier = *(*certifiers)[static_cast<size_t>(worker)];
    return std::all_of(plan.stances.begin(), plan.stances.end(), [&](const Stance& stance) {
      return certifier.Search(stance, 0, kCertifierInitialGuesses, {}).has_value();
    });
  };
}

/// Returns the options with numbers of plans that these stances allow, and records them.
DatasetOptions Builder::WithFloors(const std::vector<Stance>& stances) {
  DatasetOptions used = options_;
  if (used.different_floors) return used;
  used.different_floors = DatasetOptions::kDifferentFloors;
  if (HasPair(stances, FloorChange::kDifferent, {})) return used;
  used.same_floor += *used.different_floors;
  used.different_floors = 0;
  report_.one_floor = true;
  WriteTextFile(folder_ / kGenerationFile, DescribeGeneration(used, model_->options, PlannerOptions{}));
  return used;
}

/// Plans motion problems: first those that change floors, as in the paper's files.
void Builder::Plan(const std::vector<Stance>& stances) {
  const DatasetOptions used = WithFloors(stances);
  Show("map of the ground", 0, 1, "maps");
  const auto guide = std::make_shared<const GuideMap>(*model_);
  const auto check = PlanCheck();
  std::vector<std::pair<FloorChange, PlannedPair>> tried;
  for (const FloorChange change : {FloorChange::kDifferent, FloorChange::kSame}) {
    PairOptions pairs;
    pairs.seed = options_.seed;
    pairs.wanted = change == FloorChange::kSame ? used.same_floor : *used.different_floors;
    pairs.threads = options_.threads;
    pairs.counts = check;
    if (pairs.wanted == 0) continue;
    const std::string stage = "plans, " + std::string(ToString(change)) + " floor";
    Show(stage, 0, pairs.wanted, "plans");
    int kept = 0;
    for (PlannedPair& pair : PlanPairs(model_, guide, PlannerOptions{}, stances, change, pairs,
                                       folder_ / PlansFileName(change, options_.certified),
                                       [&](int done, int total) { Show(stage, done, total, "plans"); })) {
      if (pair.counts && kept < pairs.wanted) {
        ++kept;
        motions_.push_back({static_cast<int>(motions_.size()), pair.plan.stances});
        report_.largest_motion = std::max(report_.largest_motion, static_cast<int>(pair.plan.stances.size()));
      }
      tried.emplace_back(change, std::move(pair));
    }
  }
  report_.pairs_tried = static_cast<int>(tried.size());
  DescribePlans(tried);
}

void Builder::DescribePlans(const std::vector<std::pair<FloorChange, PlannedPair>>& tried) const {
  std::string text = "floor,pair,start,goal,found,counts,steps,cost,bound,expansions\n";
  for (const auto& [change, pair] : tried) {
    ClassicOutput line;
    line << ToString(change) << ',' << pair.pair << ',' << pair.start << ',' << pair.goal << ','
         << (pair.found() ? 1 : 0) << ',' << (pair.counts ? 1 : 0) << ',' << pair.plan.steps << ','
         << FormatFixed(pair.plan.cost, 4) << ',' << FormatFixed(pair.plan.bound, 4) << ',' << pair.plan.expansions
         << '\n';
    text += line.str();
  }
  WriteTextFile(folder_ / "plans.csv", text);
}

/// Returns the different stances on all feet of all plans, in order of first use.
std::vector<Stance> Builder::UniqueStances() const {
  std::vector<Stance> stances;
  std::map<std::string, int> seen;
  for (const ProblemDefinition& motion : motions_) {
    for (const Stance& stance : motion.stances) {
      if (stance.contacts.size() < dataset_->feet().size() || !seen.emplace(FormatStance(stance), 0).second) continue;
      stances.push_back(stance);
    }
  }
  return stances;
}

std::vector<StanceFeatures> Builder::Features(const std::vector<Stance>& stances) const {
  std::vector<StanceFeatures> features(stances.size());
  std::vector<StanceProbe> probes;
  for (int k = 0; k < options_.threads; ++k) probes.emplace_back(model_);
  ForEachIndex(options_.threads, stances.size(), [&](int worker, size_t i) {
    features[i] = FeaturesOf(stances[i], probes[static_cast<size_t>(worker)]);
  });
  return features;
}

/// Selects posture problems by K-means over the features of all plans' stances, with their proofs.
void Builder::SelectPostures() {
  if (options_.postures == 0) return;
  const std::vector<Stance> stances = UniqueStances();
  Show("postures", 0, options_.postures, "postures");
  std::vector<Eigen::Vector3d> points;
  for (const StanceFeatures& f : Features(stances)) points.emplace_back(f.length_m, f.height_m, f.trunk_distance_m);
  std::vector<PostureProver> provers;
  for (int k = 0; k < options_.threads; ++k) provers.emplace_back(dataset_);
  postures_.resize(static_cast<size_t>(options_.postures));
  const auto prove = [&](int worker, size_t cluster, int member) {
    Proven& candidate = postures_[cluster];
    candidate.stance = stances[static_cast<size_t>(member)];
    candidate.proof = provers[static_cast<size_t>(worker)].Prove(candidate.stance, static_cast<int>(cluster));
    return candidate.proof.accepted;
  };
  SelectProven(points, options_.postures, DeriveSeed(options_.seed, "clusters"), options_.threads, prove,
               [&](int proven, int count) { Show("postures", proven, count, "postures"); });
}

/// Writes the histograms of the paper's two figures.
void Builder::Describe() {
  constexpr double kDegrees = 180.0 / M_PI;
  std::string csv = "task,id,stance,length_m,height_m,tilt_deg,trunk_distance_m\n";
  const auto row = [&](const std::string& heading, const std::vector<StanceFeatures>& features) {
    HistogramRow result{heading, {}};
    const auto add = [&](const char* title, const char* unit, auto value) {
      std::vector<double> values;
      for (const StanceFeatures& f : features) values.push_back(value(f));
      result.histograms.push_back(MakeHistogram(title, unit, values));
    };
    add("stance length", "m", [](const StanceFeatures& f) { return f.length_m; });
    add("stance height", "m", [](const StanceFeatures& f) { return f.height_m; });
    add("foot tilt", "deg", [](const StanceFeatures& f) { return kDegrees * f.tilt_rad; });
    add("trunk distance", "m", [](const StanceFeatures& f) { return f.trunk_distance_m; });
    return result;
  };
  const auto list = [&](Task task, int id, int stance, const StanceFeatures& f) {
    csv += std::string(ToString(task)) + "," + std::to_string(id) + "," + std::to_string(stance) + "," +
           FormatFixed(f.length_m, 4) + "," + FormatFixed(f.height_m, 4) + "," + FormatFixed(kDegrees * f.tilt_rad, 3) +
           "," + FormatFixed(f.trunk_distance_m, 4) + "\n";
  };
  std::vector<Stance> stances;
  for (const Proven& posture : postures_) stances.push_back(posture.stance);
  const std::vector<StanceFeatures> posture_features = Features(stances);
  for (size_t i = 0; i < stances.size(); ++i) list(Task::kPosture, static_cast<int>(i), 0, posture_features[i]);
  report_.histograms.push_back(row("Posture problems", posture_features));

  std::vector<double> lengths;
  std::vector<StanceFeatures> motion_features;
  for (const ProblemDefinition& motion : motions_) {
    lengths.push_back(static_cast<double>(motion.stances.size()));
    const std::vector<StanceFeatures> features = Features(motion.stances);
    for (size_t s = 0; s < features.size(); ++s) {
      if (motion.stances[s].contacts.size() < dataset_->feet().size()) continue;
      list(Task::kMotion, motion.id, static_cast<int>(s), features[s]);
      motion_features.push_back(features[s]);
    }
  }
  HistogramRow motions = row(
      model_->reach ? "Motion problems, stances on all feet" : "Motion problems, stances on two feet", motion_features);
  motions.histograms.insert(motions.histograms.begin(), MakeHistogram("stances per problem", "", lengths));
  report_.histograms.push_back(std::move(motions));
  std::string text;
  for (const HistogramRow& r : report_.histograms) {
    text += r.heading + "\n\n";
    for (const Histogram& histogram : r.histograms) text += FormatHistogram(histogram) + "\n";
  }
  WriteTextFile(folder_ / "features.csv", csv);
  WriteTextFile(folder_ / "histograms.txt", text);
  WriteTextFile(folder_ / "histograms.svg", FormatHistogramsAsSvg(report_.histograms));
}

void Builder::FinishPostures() const {
  std::vector<ProblemDefinition> postures;
  SolutionFile solutions{dataset_->robot().name(), scenario_name_, Task::kPosture, {}};
  for (const Proven& posture : postures_) {
    postures.push_back({static_cast<int>(postures.size()), {posture.stance}});
    Solution solution;
    solution.method = PostureProver::method_name();
    solution.time_s = std::nan("");  // times vary between runs; this file must not
    solution.waypoints = {posture.proof.x};
    solution.success = true;
    solutions.problems.push_back({postures.back(), {std::move(solution)}});
  }
  WriteProblems(Task::kPosture, postures);
  WriteTextFile(folder_ / kSolutionsFile, FormatSolutions(solutions));
}

void Builder::Finish() {
  WriteProblems(Task::kMotion, motions_);
  WriteManifestHashes(folder_, options_.read_guard);
  report_.content_hash = Dataset::Load(folder_, options_.read_guard)->content_hash();
  if (options_.certified) Certify();
  for (const FloorChange change : {FloorChange::kSame, FloorChange::kDifferent}) {
    for (const bool certified : {false, true}) fs::remove(folder_ / PlansFileName(change, certified));
  }
}

/// Writes the certificate of the finished dataset. Planning has found every stance feasible.
void Builder::Certify() const {
  const auto dataset = Dataset::Load(folder_, options_.read_guard);
  const certify::StanceCatalogue catalogue(*dataset);
  certify::CertifyOptions certify_options;
  certify_options.threads = options_.threads;
  certify::CertifyHooks hooks;
  hooks.progress = [this](const char* stage, size_t done, size_t total) {
    Show(std::string("certificate, ") + stage, static_cast<double>(done), static_cast<double>(total), "stances");
  };
  const certify::Certificate certificate = certify::CertifyDataset(dataset, catalogue, certify_options, nullptr, hooks);
  WriteTextFile(folder_ / certify::kCertificateFileName, FormatCertificate(certificate, catalogue, *dataset));
}

}  // namespace

std::string DatasetOptions::StanceOptionsText() const {
  std::string text = "name " + name;
  if (scenario) {
    text += ", " + std::string(ToString(scenario->kind)) + " " + std::string(ToString(scenario->level)) +
            ", scenario seed " + std::to_string(scenario->seed);
  }
  text += ", seed " + std::to_string(seed) + ", stances " + std::to_string(stances);
  if (radius_m) text += ", radius " + FormatFixed(*radius_m, 6);
  if (slope_rad) text += ", slope " + FormatFixed(*slope_rad, 6);
  if (proven) text += ", proven stances " + HashFile(*proven);
  return text;
}

std::string DatasetOptions::Identity() const {
  return StanceOptionsText() + ", plans " + std::to_string(same_floor) + " + " +
         std::to_string(different_floors.value_or(kDifferentFloors)) + ", postures " + std::to_string(postures) +
         (certified ? ", certified" : "");
}

ProbeOptions DatasetOptions::ProbeFor(const Dataset& dataset) const {
  ProbeOptions probe = ProbeOptions::For(dataset);
  probe.reach_m = radius_m.value_or(probe.reach_m);
  probe.slope_rad = slope_rad.value_or(probe.slope_rad);
  return probe;
}

void DatasetOptions::Validate() const {
  const auto refuse = [](const char* field, const std::string& value, const char* message, const char* fix) {
    throw InputError({"", field, value, message, fix});
  };
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  if (!plain) refuse("--name", name, "must consist of letters, digits, '-' and '_'", "e.g. my-garage");
  constexpr int kMost = 100000;
  for (const auto& [field, value, least] :
       {std::tuple("--stances", stances, 2), std::tuple("--same-floor", same_floor, 0),
        std::tuple("--different-floors", different_floors.value_or(0), 0), std::tuple("--postures", postures, 0),
        std::tuple("--threads", threads, 1)}) {
    if (value < least || value > kMost) refuse(field, std::to_string(value), "out of range", "see --help");
  }
}

DatasetReport BuildDataset(const DatasetOptions& options, const fs::path& folder, const BuildProgress& progress) {
  options.Validate();
  if (options.same_floor + options.different_floors.value_or(DatasetOptions::kDifferentFloors) == 0) {
    throw InputError(
        {"", "--same-floor", "0", "a dataset needs plans: postures are chosen from their stances", "ask for some"});
  }
  return Builder(options, folder, progress).Build();
}

DatasetReport BuildCandidates(const DatasetOptions& options, const fs::path& folder, const BuildProgress& progress) {
  options.Validate();
  DatasetOptions used = options;  // the options recorded in the files
  used.same_floor = used.postures = 0;
  used.different_floors = 0;
  return Builder(used, folder, progress).BuildCandidates();
}

}  // namespace legopt::worldgen
