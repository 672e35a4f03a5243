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
#include "legopt/planning/certify/internal/balance_prover.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/contact_station.h"
#include "legopt/worldgen/internal/posture_selection.h"
#include "legopt/worldgen/internal/seeds.h"
#include "legopt/worldgen/internal/station_field.h"

namespace legopt::worldgen {
namespace {

namespace fs = std::filesystem;

/// Friction by which a proof must exceed the problem's, so that no tolerance decides it.
constexpr double kFrictionMargin = 0.02;
/// Push that a posture must resist from level intermediate on, as a share of the weight.
constexpr double kPushShare = 0.05;
/// Least area of the equilibrium polygon of a station that is tried.
constexpr double kLeastArea_m2 = 2e-3;

/// A family's share of the problems.
struct Share {
  ContactFamily family{};
  int weight = 0;
};
constexpr std::array kShares = {Share{ContactFamily::kSlide, 40}, Share{ContactFamily::kReach, 30},
                                Share{ContactFamily::kClimb, 30}, Share{ContactFamily::kRubble, 40}};

constexpr std::array kLevels = {ContactLevel::kEasy, ContactLevel::kIntermediate, ContactLevel::kHard};

/// The stance with hands that only touch.
Stance WithIdleHands(const Dataset& dataset, Stance stance) {
  for (ContactTarget& target : stance.contacts) {
    if (!dataset.contact(target.contact).facts().supports) target.carries = false;
  }
  return stance;
}

/// Returns a proof that the stance slides whatever the posture, even with more friction than it has.
std::optional<SlideProof> SlideWithMargin(const Dataset& dataset, const Stance& stance) {
  if (SlidesUnderLoad(dataset, stance)) return std::nullopt;  // another grip may hold
  std::vector<TouchedSurface> surfaces = SurfacesOf(dataset, stance);
  for (TouchedSurface& surface : surfaces) surface.friction += kFrictionMargin;
  return ComputeEquilibriumPolygon(StanceForces(surfaces, FrictionPyramid::kCircumscribed)).slide;
}

double PolygonArea_m2(const Dataset& dataset, const Stance& stance) {
  const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(StanceForces(SurfacesOf(dataset, stance)));
  return polygon.corners.size() < 3 ? 0.0 : PolygonArea(polygon.corners);
}

int NumHands(const Dataset& dataset, const Stance& stance) {
  return static_cast<int>(std::ranges::count_if(
      stance.contacts, [&](const ContactTarget& target) { return !dataset.contact(target.contact).facts().supports; }));
}

/// Why feet alone do not hold a station, as in the column of features.csv.
std::string FeetAlone(const Dataset& dataset, const Station& station) {
  const Stance feet = WithIdleHands(dataset, station.stance);
  if (NumHands(dataset, feet) == 0) return "no hands";
  if (SlideWithMargin(dataset, feet)) return "slide proven";
  return certify::RefuteBalance(dataset, feet) ? "reach proven" : "open";
}

/// Returns true if a station has what its family promises, as far as geometry and forces tell.
bool IsPlausible(const Dataset& dataset, const Station& station) {
  const int hands = NumHands(dataset, station.stance);
  if (station.family != ContactFamily::kRubble && hands == 0) return false;
  if (!(PolygonArea_m2(dataset, station.stance) >= kLeastArea_m2)) return false;
  const std::string alone = FeetAlone(dataset, station);
  if (station.family == ContactFamily::kSlide) return alone == "slide proven";
  if (station.family == ContactFamily::kReach) return alone == "reach proven";
  return true;
}

/// A station with its planted posture.
struct Planted {
  Station station;
  PlantedPosture posture;
};

/// Numbers of stations of a family and level.
struct Counts {
  int drawn = 0, plausible = 0, solved = 0;
};

class ContactBuilder {
 public:
  ContactBuilder(const ContactDatasetOptions& options, fs::path folder, const BuildProgress& progress)
      : options_(options),
        folder_(std::move(folder)),
        progress_(progress),
        source_(Dataset::Load(options.robot_folder, options.read_guard)) {}

  ContactDatasetReport Build() {
    for (const auto& [family, count] : Quotas()) Choose(family, count);
    WriteDataset();
    WriteTraps();
    Certify();
    return std::move(report_);
  }

 private:
  using Key = std::pair<ContactFamily, ContactLevel>;

  std::vector<std::pair<ContactFamily, int>> Quotas() const;
  void Choose(ContactFamily family, int count);
  std::vector<Planted> PlantMany(const Key& key, int wanted, Counts* counts);
  std::vector<Station> DrawPlausible(const Key& key, int first, int number, Counts* counts);
  std::vector<Planted> Solve(const std::vector<Station>& stations);
  std::mt19937_64 Generator(const Key& key, const std::string& purpose, int number) const;
  Vector6d Features(const Planted& planted) const;
  void WriteDataset();
  void WriteTraps();
  void Certify();
  void Describe();

  const ContactDatasetOptions& options_;
  fs::path folder_;
  const BuildProgress& progress_;
  std::shared_ptr<const Dataset> source_;
  std::vector<Planted> chosen_;
  ContactDatasetReport report_;
};

/// Returns the families that suit the robot, with their numbers of problems.
std::vector<std::pair<ContactFamily, int>> ContactBuilder::Quotas() const {
  const StationDrawer drawer(source_);
  int weights = 0;
  for (const Share& share : kShares) weights += drawer.Suits(share.family) ? share.weight : 0;
  if (weights == 0) {
    throw InputError({(options_.robot_folder / kDatasetFileName).string(), "contacts", "",
                      "the robot has neither hands nor more than two feet",
                      "declare contacts of kind palm or rail (docs/reference/datasets.md#contacts)"});
  }
  std::vector<std::pair<ContactFamily, int>> quotas;
  int left = options_.postures;
  for (const Share& share : kShares) {
    if (!drawer.Suits(share.family)) continue;
    const int count = weights == share.weight ? left : left * share.weight / weights;
    quotas.emplace_back(share.family, count);
    left -= count;
    weights -= share.weight;
  }
  return quotas;
}

std::mt19937_64 ContactBuilder::Generator(const Key& key, const std::string& purpose, int number) const {
  return std::mt19937_64(DeriveSeed(options_.seed, purpose + "/" + std::string(legopt::ToString(key.first)) + "/" +
                                                       std::string(legopt::ToString(key.second)) + "/" +
                                                       std::to_string(number)));
}

/// Draws the stations of `number` numbers from `first` on, and returns the plausible ones in their order.
std::vector<Station> ContactBuilder::DrawPlausible(const Key& key, int first, int number, Counts* counts) {
  std::vector<std::optional<Station>> drawn(static_cast<std::size_t>(number));
  std::vector<StationDrawer> drawers(static_cast<std::size_t>(options_.threads), StationDrawer(source_));
  ForEachIndex(options_.threads, drawn.size(), [&](int worker, std::size_t i) {
    std::mt19937_64 generator = Generator(key, "station", first + static_cast<int>(i));
    Station station = drawers[static_cast<std::size_t>(worker)].Draw(key.first, key.second, generator);
    if (key.second != ContactLevel::kEasy) {
      station.stance.push_N = kPushShare * source_->robot().total_mass() * source_->gravity_m_s2();
    }
    if (IsPlausible(*source_, station)) drawn[i] = std::move(station);
  });
  counts->drawn += number;
  std::vector<Station> plausible;
  for (std::optional<Station>& station : drawn) {
    if (station) plausible.push_back(std::move(*station));
  }
  counts->plausible += static_cast<int>(plausible.size());
  return plausible;
}

/// Searches postures of stations in a field of their own; returns those that have one.
std::vector<Planted> ContactBuilder::Solve(const std::vector<Station>& stations) {
  const fs::path field = folder_ / "candidates";
  fs::create_directories(field);
  WriteStations(options_.robot_folder, "candidates", "Candidates", stations, field, options_.read_guard);
  const auto dataset = Dataset::Load(field, options_.read_guard);
  std::vector<std::unique_ptr<PostureFinder>> finders;
  for (int k = 0; k < options_.threads; ++k) finders.push_back(std::make_unique<PostureFinder>(dataset));
  std::vector<Planted> all(stations.size());
  const Eigen::Index base = dataset->robot().base_position_index();
  ForEachIndex(options_.threads, stations.size(), [&](int worker, std::size_t i) {
    all[i] = {.station = stations[i],
              .posture = finders[static_cast<std::size_t>(worker)]->Find(dataset->problems(Task::kPosture)[i])};
    if (all[i].posture.accepted) all[i].posture.x.segment<3>(base) -= PlaceOfStation(*dataset, i, stations.size());
  });
  fs::remove_all(field);
  std::erase_if(all, [](const Planted& planted) { return !planted.posture.accepted; });
  return all;
}

std::vector<Planted> ContactBuilder::PlantMany(const Key& key, int wanted, Counts* counts) {
  constexpr int kBatch = 400, kMostDrawn = 2'000;
  constexpr int kPerPosture = 4, kLeastInField = 12, kMostInField = 100;
  const auto most = static_cast<std::size_t>(std::clamp(kPerPosture * wanted, kLeastInField, kMostInField));
  const std::string stage = std::string(legopt::ToString(key.first)) + ", " + std::string(legopt::ToString(key.second));
  std::vector<Planted> planted;
  for (int first = 0; first < kMostDrawn && std::ssize(planted) < wanted; first += kBatch) {
    if (progress_) progress_(stage, static_cast<double>(planted.size()), wanted, "postures");
    std::vector<Station> stations = DrawPlausible(key, first, kBatch, counts);
    if (stations.size() > most) stations.resize(most);
    if (stations.empty()) continue;
    for (Planted& found : Solve(stations)) {
      ++counts->solved;
      if (std::ssize(planted) < wanted) planted.push_back(std::move(found));
    }
  }
  return planted;
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
    Counts counts;
    std::vector<Planted> planted = PlantMany({family, level}, kCandidatesPerProblem * wanted, &counts);
    report_.lines.push_back(std::string(legopt::ToString(family)) + ", " + std::string(legopt::ToString(level)) + ": " +
                            std::to_string(counts.drawn) + " drawn, " + std::to_string(counts.plausible) +
                            " plausible, " + std::to_string(counts.solved) + " with a posture, " +
                            std::to_string(wanted) + " chosen");
    if (std::ssize(planted) < wanted) {
      throw InputError({"", "--postures", std::to_string(options_.postures),
                        "too few stations of this robot have a posture: " + report_.lines.back(),
                        "ask for fewer, or check the robot's contacts and effort limits"});
    }
    std::vector<Vector6d> points;
    for (const Planted& candidate : planted) points.push_back(Features(candidate));
    const std::string purpose =
        "clusters/" + std::string(legopt::ToString(family)) + "/" + std::string(legopt::ToString(level));
    for (const std::vector<int>& cluster : ClusterPoints(points, wanted, DeriveSeed(options_.seed, purpose))) {
      chosen_.push_back(planted[static_cast<std::size_t>(cluster.front())]);
    }
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
  std::vector<Station> stations;
  for (const Planted& planted : chosen_) stations.push_back(planted.station);
  WriteStations(options_.robot_folder, options_.name, "Made by `legopt generate`; " + options_.Identity(), stations,
                folder_, options_.read_guard);
  const auto dataset = Dataset::Load(folder_, options_.read_guard);
  report_.content_hash = dataset->content_hash();
  const Eigen::Index base = dataset->robot().base_position_index();
  std::vector<std::unique_ptr<PostureFinder>> finders;
  for (int k = 0; k < options_.threads; ++k) finders.push_back(std::make_unique<PostureFinder>(dataset));
  ForEachIndex(options_.threads, chosen_.size(), [&](int worker, std::size_t i) {
    Eigen::VectorXd x = chosen_[i].posture.x;
    x.segment<3>(base) += PlaceOfStation(*dataset, i, chosen_.size());
    const ProblemDefinition& problem = dataset->problems(Task::kPosture)[i];
    chosen_[i].posture = finders[static_cast<std::size_t>(worker)]->Measure(problem, x);
  });
  SolutionFile solutions{dataset->robot().name(), "stations", Task::kPosture, {}};
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    if (!chosen_[i].posture.accepted) {
      throw InputError(
          {"", "--seed", std::to_string(options_.seed),
           "the posture of station " + std::to_string(i) + " is not accepted any more at its place in the dataset",
           "use another seed, and report this one"});
    }
    Solution solution;
    solution.method = PlantedPosture::kMethod;
    solution.time_s = std::nan("");  // times vary between runs; this file must not
    solution.waypoints = {chosen_[i].posture.x};
    solution.success = true;
    solutions.problems.push_back({dataset->problems(Task::kPosture)[i], {std::move(solution)}});
  }
  WriteTextFile(folder_ / "solutions-posture.json", FormatSolutions(solutions));
  WriteTextFile(folder_ / "generation.json", Dump(nlohmann::ordered_json{{"format", "legopt-contacts/1"},
                                                                         {"seed", options_.seed},
                                                                         {"postures", options_.postures},
                                                                         {"traps", options_.traps},
                                                                         {"friction", StationDrawer::kFriction},
                                                                         {"friction_margin", kFrictionMargin},
                                                                         {"push_share", kPushShare},
                                                                         {"source", source_->content_hash()}},
                                                  1) +
                                                 "\n");
  Describe();
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
    std::mt19937_64 generator = Generator({family, ContactLevel::kHard}, "trap", number);
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
                "Made by `legopt generate`: stances that no forces hold; " + options_.Identity(), traps, folder,
                options_.read_guard);
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
         ", traps " + std::to_string(traps);
}

void ContactDatasetOptions::Validate() const {
  constexpr int kMost = 10'000;
  for (const auto& [field, value, least] :
       {std::tuple("--postures", postures, 1), std::tuple("--traps", traps, 0), std::tuple("--threads", threads, 1)}) {
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
