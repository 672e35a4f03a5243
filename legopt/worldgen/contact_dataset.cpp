#include "legopt/worldgen/contact_dataset.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/input/json.h"
#include "legopt/judge/solution_file.h"
#include "legopt/math/parallel.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/contact_planter.h"
#include "legopt/worldgen/internal/posture_selection.h"
#include "legopt/worldgen/internal/seeds.h"
#include "legopt/worldgen/internal/station_field.h"

namespace legopt::worldgen {
namespace {

namespace fs = std::filesystem;

/// A family's share of the problems.
struct Share {
  ContactFamily family{};
  int weight = 0;
};
constexpr std::array kShares = {Share{ContactFamily::kSlide, 40}, Share{ContactFamily::kReach, 30},
                                Share{ContactFamily::kClimb, 30}, Share{ContactFamily::kRubble, 40}};

constexpr std::array kLevels = {ContactLevel::kEasy, ContactLevel::kIntermediate, ContactLevel::kHard};

class ContactBuilder {
 public:
  ContactBuilder(const ContactDatasetOptions& options, fs::path folder, const BuildProgress& progress)
      : options_(options),
        folder_(std::move(folder)),
        progress_(progress),
        source_(Dataset::Load(options.robot_folder, options.read_guard)),
        planter_(options, folder_, progress, source_) {}

  ContactDatasetReport Build() {
    for (const auto& [family, count] : Quotas(options_.postures)) Choose(family, count);
    for (const auto& [family, count] : Quotas(options_.motions)) ChooseCourses(family, count);
    WriteDataset();
    WriteTraps();
    Certify();
    return std::move(report_);
  }

 private:
  std::vector<std::pair<ContactFamily, int>> Quotas(int total) const;
  void Choose(ContactFamily family, int count);
  void ChooseCourses(ContactFamily family, int count);
  /// Throws InputError.
  [[noreturn]] void RefuseTooFew(const std::string& flag, int number, const std::string& line) const;
  Vector6d Features(const Planted& planted) const;
  void WriteDataset();
  void MoveToPlaces(const std::shared_ptr<const Dataset>& dataset, std::size_t count);
  void WriteSolutions(const Dataset& dataset);
  void WriteTraps();
  void Certify();
  void Describe();

  const ContactDatasetOptions& options_;
  fs::path folder_;
  const BuildProgress& progress_;
  std::shared_ptr<const Dataset> source_;
  ContactPlanter planter_;
  std::vector<Planted> chosen_;
  std::vector<PlantedCourse> courses_;
  ContactDatasetReport report_;
};

/// Returns the families that suit the robot, with their shares of `total` problems.
std::vector<std::pair<ContactFamily, int>> ContactBuilder::Quotas(int total) const {
  const StationDrawer drawer(source_);
  int weights = 0;
  for (const Share& share : kShares) weights += drawer.Suits(share.family) ? share.weight : 0;
  if (weights == 0) {
    throw InputError({(options_.robot_folder / kDatasetFileName).string(), "contacts", "",
                      "the robot has neither hands nor more than two feet",
                      "declare contacts of kind palm or rail (docs/reference/datasets.md#contacts)"});
  }
  std::vector<std::pair<ContactFamily, int>> quotas;
  int left = total;
  for (const Share& share : kShares) {
    if (!drawer.Suits(share.family)) continue;
    const int count = weights == share.weight ? left : left * share.weight / weights;
    quotas.emplace_back(share.family, count);
    left -= count;
    weights -= share.weight;
  }
  return quotas;
}

Vector6d ContactBuilder::Features(const Planted& planted) const {
  double tilt_rad = 0.0, low = 1e9, high = -1e9;
  for (const ContactTarget& target : planted.station.stance.contacts) {
    const bool is_foot = source_->contact(target.contact).facts().supports;
    if (is_foot) tilt_rad = std::max(tilt_rad, std::acos(std::clamp(NormalOf(target).z(), -1.0, 1.0)));
    low = std::min(low, target.position.z());
    high = std::max(high, target.position.z());
  }
  Vector6d features;
  features << static_cast<double>(planted.station.stance.contacts.size()), tilt_rad * 180.0 / M_PI, high - low,
      std::log10(PolygonArea_m2(*source_, planted.station.stance)), planted.posture.push_N,
      planted.posture.trunk_distance_m;
  return features;
}

/// Chooses problems of a family, the same number of each level.
void ContactBuilder::Choose(ContactFamily family, int count) {
  constexpr int kCandidatesPerProblem = 3;
  int left = count, levels = static_cast<int>(kLevels.size());
  for (const ContactLevel level : kLevels) {
    const int wanted = left / levels--;
    left -= wanted;
    if (wanted == 0) continue;
    ContactPlanter::Counts counts;
    std::vector<Planted> planted = planter_.Plant({family, level}, kCandidatesPerProblem * wanted, &counts);
    report_.lines.push_back(std::string(legopt::ToString(family)) + ", " + std::string(legopt::ToString(level)) + ": " +
                            std::to_string(counts.drawn) + " drawn, " + std::to_string(counts.plausible) +
                            " plausible, " + std::to_string(counts.solved) + " with a posture, " +
                            std::to_string(wanted) + " chosen");
    if (std::ssize(planted) < wanted) RefuseTooFew("--postures", options_.postures, report_.lines.back());
    std::vector<Vector6d> points;
    for (const Planted& candidate : planted) points.push_back(Features(candidate));
    const std::string purpose =
        "clusters/" + std::string(legopt::ToString(family)) + "/" + std::string(legopt::ToString(level));
    for (const std::vector<int>& cluster : ClusterPoints(points, wanted, DeriveSeed(options_.seed, purpose))) {
      chosen_.push_back(planted[static_cast<std::size_t>(cluster.front())]);
    }
  }
}

void ContactBuilder::RefuseTooFew(const std::string& flag, int number, const std::string& line) const {
  throw InputError({"", flag, std::to_string(number), "too few stations of this robot have a solution: " + line,
                    "ask for fewer, or check the robot's contacts and effort limits"});
}

/// Takes the first courses of a family that have a motion, the same number of each level.
void ContactBuilder::ChooseCourses(ContactFamily family, int count) {
  int left = count, levels = static_cast<int>(kLevels.size());
  for (const ContactLevel level : kLevels) {
    const int wanted = left / levels--;
    left -= wanted;
    if (wanted == 0) continue;
    ContactPlanter::Counts counts;
    std::vector<PlantedCourse> planted = planter_.PlantCourses({family, level}, wanted, &counts);
    report_.lines.push_back(std::string(legopt::ToString(family)) + ", " + std::string(legopt::ToString(level)) +
                            ", motions: " + std::to_string(counts.drawn) + " drawn, " +
                            std::to_string(counts.plausible) + " plausible, " + std::to_string(counts.solved) +
                            " solved, " + std::to_string(planted.size()) + " taken");
    if (std::ssize(planted) < wanted) RefuseTooFew("--motions", options_.motions, report_.lines.back());
    std::ranges::move(planted, std::back_inserter(courses_));
  }
}

void ContactBuilder::Describe() {
  static constexpr std::array<std::array<const char*, 2>, 6> kNames = {{{"contacts", ""},
                                                                        {"largest tilt of feet", "deg"},
                                                                        {"height range", "m"},
                                                                        {"log10 of polygon area", ""},
                                                                        {"resisted push", "N"},
                                                                        {"trunk distance", "m"}}};
  std::string csv = "id,family,level,feet_alone,contacts,tilt_deg,height_m,log10_area,push_N,trunk_distance_m\n";
  std::array<std::vector<double>, 6> values;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const Planted& planted = chosen_[i];
    csv += std::to_string(i) + "," + std::string(legopt::ToString(planted.station.family)) + "," +
           std::string(legopt::ToString(planted.station.level)) + "," + FeetAlone(*source_, planted.station);
    const Vector6d features = Features(planted);
    for (int f = 0; f < 6; ++f) {
      csv += "," + FormatFixed(features[f], 4);
      values[static_cast<std::size_t>(f)].push_back(features[f]);
    }
    csv += "\n";
  }
  HistogramRow row{"Posture problems", {}};
  for (std::size_t f = 0; f < values.size(); ++f) {
    row.histograms.push_back(MakeHistogram(kNames[f][0], kNames[f][1], values[f]));
  }
  report_.histograms.push_back(row);
  std::string text = row.heading + "\n\n";
  for (const Histogram& histogram : row.histograms) text += FormatHistogram(histogram) + "\n";
  WriteTextFile(folder_ / "features.csv", csv);
  WriteTextFile(folder_ / "histograms.txt", text);
  WriteTextFile(folder_ / "histograms.svg", FormatHistogramsAsSvg(report_.histograms));
}

void ContactBuilder::WriteDataset() {
  StationField field;
  for (const Planted& planted : chosen_) field.stations.push_back(planted.station);
  for (const PlantedCourse& planted : courses_) field.courses.push_back(planted.course);
  WriteStations(options_.robot_folder, options_.name, "Made by `legopt generate`; " + options_.Identity(), field,
                folder_, options_.read_guard);
  const auto dataset = Dataset::Load(folder_, options_.read_guard);
  report_.content_hash = dataset->content_hash();
  MoveToPlaces(dataset, field.size());
  WriteSolutions(*dataset);
  WriteTextFile(folder_ / "generation.json", Dump(nlohmann::ordered_json{{"format", "legopt-contacts/2"},
                                                                         {"seed", options_.seed},
                                                                         {"postures", options_.postures},
                                                                         {"motions", options_.motions},
                                                                         {"traps", options_.traps},
                                                                         {"friction", StationDrawer::kFriction},
                                                                         {"friction_margin", kFrictionMargin},
                                                                         {"push_share", kPushShare},
                                                                         {"source", source_->content_hash()}},
                                                  1) +
                                                 "\n");
  Describe();
}

/// Moves the planted solutions to their places of `count`, and judges them there.
void ContactBuilder::MoveToPlaces(const std::shared_ptr<const Dataset>& dataset, std::size_t count) {
  const Eigen::Index base = dataset->robot().base_position_index();
  const std::vector<std::unique_ptr<PostureFinder>> finders = planter_.Finders(dataset);
  ForEachIndex(options_.threads, count, [&](int worker, std::size_t i) {
    PostureFinder& finder = *finders[static_cast<std::size_t>(worker)];
    const Eigen::Vector3d place = PlaceOfStation(*dataset, i, count);
    if (i < chosen_.size()) {
      Eigen::VectorXd x = chosen_[i].posture.x;
      x.segment<3>(base) += place;
      chosen_[i].posture = finder.Measure(dataset->problems(Task::kPosture)[i], x);
      return;
    }
    PlantedMotion& motion = courses_[i - chosen_.size()].motion;
    for (Eigen::VectorXd& x : motion.waypoints) x.segment<3>(base) += place;
    motion.accepted = finder.Accepts(dataset->problems(Task::kMotion)[i - chosen_.size()], motion.waypoints);
  });
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_station = i < chosen_.size();
    if (is_station ? chosen_[i].posture.accepted : courses_[i - chosen_.size()].motion.accepted) continue;
    throw InputError({"", "--seed", std::to_string(options_.seed),
                      "the solution of place " + std::to_string(i) + " is not accepted any more in the dataset",
                      "use another seed, and report this one"});
  }
}

/// Writes the planted solutions.
void ContactBuilder::WriteSolutions(const Dataset& dataset) {
  const auto write = [&](Task task, const char* file, const auto& waypoints_of) {
    const std::vector<ProblemDefinition>& problems = dataset.problems(DescriptionOf(task).problems);
    SolutionFile solutions{dataset.robot().name(), "stations", task, {}};
    for (std::size_t i = 0; i < problems.size(); ++i) {
      Solution solution;
      solution.method = PlantedPosture::kMethod;
      solution.time_s = std::nan("");  // times vary between runs; this file must not
      solution.waypoints = waypoints_of(i);
      solution.success = true;
      solutions.problems.push_back({problems[i], {std::move(solution)}});
    }
    if (!problems.empty()) WriteTextFile(folder_ / file, FormatSolutions(solutions));
  };
  write(Task::kPosture, "solutions-posture.json",
        [&](std::size_t i) { return std::vector<Eigen::VectorXd>{chosen_[i].posture.x}; });
  write(Task::kBalanced, "solutions-motion.json", [&](std::size_t i) { return courses_[i].motion.waypoints; });
}

/// Writes stances of slopes and fragments that slide with all their contacts.
void ContactBuilder::WriteTraps() {
  if (options_.traps == 0) return;
  StationDrawer drawer(source_);
  const ContactFamily family = drawer.Suits(ContactFamily::kRubble) ? ContactFamily::kRubble : ContactFamily::kSlide;
  constexpr int kMostDrawn = 100'000;
  std::vector<Station> traps;
  nlohmann::ordered_json proofs = nlohmann::ordered_json::array();
  for (int number = 0; number < kMostDrawn && std::ssize(traps) < options_.traps; ++number) {
    std::mt19937_64 generator = planter_.Generator({family, ContactLevel::kHard}, "trap", number);
    Station station = drawer.Draw(family, ContactLevel::kHard, generator);
    const bool complete = family == ContactFamily::kRubble || NumHands(*source_, station.stance) > 0;
    const std::optional<SlideProof> proof = complete ? SlideWithMargin(*source_, station.stance) : std::nullopt;
    if (!proof) continue;
    proofs.push_back({{"id", traps.size()},
                      {"direction", {proof->direction.x(), proof->direction.y(), proof->direction.z()}},
                      {"turn", proof->turn},
                      {"margin", proof->margin},
                      {"largest", proof->largest}});
    traps.push_back(std::move(station));
  }
  if (std::ssize(traps) < options_.traps) {
    throw InputError({"", "--traps", std::to_string(options_.traps),
                      "only " + std::to_string(traps.size()) + " stances that slide were found", "ask for fewer"});
  }
  const fs::path folder = folder_ / "traps";
  fs::create_directories(folder);
  WriteStations(options_.robot_folder, options_.name + "-traps",
                "Made by `legopt generate`: stances that no forces hold; " + options_.Identity(),
                {.stations = traps, .courses = {}}, folder, options_.read_guard);
  WriteTextFile(folder / "proofs.json", Dump(nlohmann::ordered_json{{"format", "legopt-slide-proofs/1"},
                                                                    {"pyramid", "circumscribed"},
                                                                    {"friction_margin", kFrictionMargin},
                                                                    {"proofs", proofs}},
                                             1) +
                                            "\n");
}

void ContactBuilder::Certify() {
  const auto dataset = Dataset::Load(folder_, options_.read_guard);
  const certify::StanceCatalogue catalogue(*dataset);
  certify::CertifyOptions certify_options;
  certify_options.threads = options_.threads;
  certify::CertifyHooks hooks;
  hooks.progress = [this](const char* stage, std::size_t done, std::size_t total) {
    if (!progress_) return;
    progress_(std::string("certificate, ") + stage, static_cast<double>(done), static_cast<double>(total), "stances");
  };
  const certify::Certificate certificate = certify::CertifyDataset(dataset, catalogue, certify_options, nullptr, hooks);
  WriteTextFile(folder_ / certify::kCertificateFileName, FormatCertificate(certificate, catalogue, *dataset));
}

}  // namespace

std::string ContactDatasetOptions::Identity() const {
  return "name " + name + ", contacts, seed " + std::to_string(seed) + ", postures " + std::to_string(postures) +
         ", motions " + std::to_string(motions) + ", traps " + std::to_string(traps);
}

void ContactDatasetOptions::Validate() const {
  constexpr int kMost = 10'000;
  for (const auto& [field, value, least] : {std::tuple("--postures", postures, 1), std::tuple("--motions", motions, 0),
                                            std::tuple("--traps", traps, 0), std::tuple("--threads", threads, 1)}) {
    if (value >= least && value <= kMost) continue;
    throw InputError({"", field, std::to_string(value), "out of range", "see --help"});
  }
}

ContactDatasetReport BuildContactDataset(const ContactDatasetOptions& options, const fs::path& folder,
                                         const BuildProgress& progress) {
  options.Validate();
  return ContactBuilder(options, folder, progress).Build();
}

}  // namespace legopt::worldgen
