#include "legopt/worldgen/internal/contact_planter.h"

#include <algorithm>

#include "legopt/math/parallel.h"
#include "legopt/planning/certify/internal/balance_prover.h"
#include "legopt/worldgen/internal/seeds.h"

namespace legopt::worldgen {

namespace fs = std::filesystem;

namespace {

/// Least area of the equilibrium polygon of a station that is tried.
constexpr double kLeastArea_m2 = 2e-3;

/// The stance with hands that only touch.
Stance WithIdleHands(const Dataset& dataset, Stance stance) {
  for (ContactTarget& target : stance.contacts) {
    if (!dataset.contact(target.contact).facts().supports) target.carries = false;
  }
  return stance;
}

}  // namespace

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

std::string FeetAlone(const Dataset& dataset, const Station& station) {
  const Stance feet = WithIdleHands(dataset, station.stance);
  if (NumHands(dataset, feet) == 0) return "no hands";
  if (SlideWithMargin(dataset, feet)) return "slide proven";
  return certify::RefuteBalance(dataset, feet) ? "reach proven" : "open";
}

namespace {

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

}  // namespace

std::mt19937_64 ContactPlanter::Generator(const Key& key, const std::string& purpose, int number) const {
  return std::mt19937_64(DeriveSeed(options_.seed, purpose + "/" + std::string(legopt::ToString(key.first)) + "/" +
                                                       std::string(legopt::ToString(key.second)) + "/" +
                                                       std::to_string(number)));
}

/// Draws the stations of `number` numbers from `first` on, and returns the plausible ones in their order.
std::vector<Station> ContactPlanter::DrawPlausible(const Key& key, int first, int number, Counts* counts) {
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
std::vector<Planted> ContactPlanter::Solve(const std::vector<Station>& stations) {
  const fs::path field = folder_ / "candidates";
  fs::create_directories(field);
  WriteStations(options_.robot_folder, "candidates", "Candidates", {.stations = stations, .courses = {}}, field,
                options_.read_guard);
  const auto dataset = Dataset::Load(field, options_.read_guard);
  const std::vector<std::unique_ptr<PostureFinder>> finders = Finders(dataset);
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

std::vector<Planted> ContactPlanter::Plant(const Key& key, int wanted, Counts* counts) {
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

std::vector<std::unique_ptr<PostureFinder>> ContactPlanter::Finders(
    const std::shared_ptr<const Dataset>& dataset) const {
  std::vector<std::unique_ptr<PostureFinder>> finders;
  for (int k = 0; k < options_.threads; ++k) finders.push_back(std::make_unique<PostureFinder>(dataset));
  return finders;
}

/// Draws the courses of `number` numbers from `first` on, and returns those in their order of which every stance has a
/// polygon to balance in.
std::vector<Course> ContactPlanter::DrawPlausibleCourses(const Key& key, int first, int number, Counts* counts) {
  std::vector<std::optional<Course>> drawn(static_cast<std::size_t>(number));
  std::vector<CourseDrawer> drawers(static_cast<std::size_t>(options_.threads), CourseDrawer(source_));
  ForEachIndex(options_.threads, drawn.size(), [&](int worker, std::size_t i) {
    std::mt19937_64 generator = Generator(key, "course", first + static_cast<int>(i));
    Course course = drawers[static_cast<std::size_t>(worker)].Draw(key.first, key.second, generator);
    if (!IsPlausible(*source_, course.station)) return;
    const bool balances = std::ranges::all_of(
        course.stances, [&](const Stance& stance) { return PolygonArea_m2(*source_, stance) >= kLeastArea_m2; });
    if (balances) drawn[i] = std::move(course);
  });
  counts->drawn += number;
  std::vector<Course> plausible;
  for (std::optional<Course>& course : drawn) {
    if (course) plausible.push_back(std::move(*course));
  }
  counts->plausible += static_cast<int>(plausible.size());
  return plausible;
}

/// Searches motions of courses in a field of their own; returns those that have one.
std::vector<PlantedCourse> ContactPlanter::SolveCourses(const std::vector<Course>& courses) {
  const fs::path field = folder_ / "candidates";
  fs::create_directories(field);
  WriteStations(options_.robot_folder, "candidates", "Candidates", {.stations = {}, .courses = courses}, field,
                options_.read_guard);
  const auto dataset = Dataset::Load(field, options_.read_guard);
  const std::vector<std::unique_ptr<PostureFinder>> finders = Finders(dataset);
  std::vector<PlantedCourse> all(courses.size());
  const Eigen::Index base = dataset->robot().base_position_index();
  ForEachIndex(options_.threads, courses.size(), [&](int worker, std::size_t i) {
    const ProblemDefinition& problem = dataset->problems(Task::kMotion)[i];
    all[i] = {.course = courses[i], .motion = finders[static_cast<std::size_t>(worker)]->FindMotion(problem)};
    const Eigen::Vector3d place = PlaceOfStation(*dataset, i, courses.size());
    for (Eigen::VectorXd& x : all[i].motion.waypoints) x.segment<3>(base) -= place;
  });
  fs::remove_all(field);
  std::erase_if(all, [](const PlantedCourse& planted) { return !planted.motion.accepted; });
  return all;
}

std::vector<PlantedCourse> ContactPlanter::PlantCourses(const Key& key, int wanted, Counts* counts) {
  constexpr int kBatch = 200, kMostDrawn = 4'000, kPerMotion = 3;
  const std::string stage =
      std::string(legopt::ToString(key.first)) + ", " + std::string(legopt::ToString(key.second)) + ", motions";
  std::vector<PlantedCourse> planted;
  for (int first = 0; first < kMostDrawn && std::ssize(planted) < wanted; first += kBatch) {
    if (progress_) progress_(stage, static_cast<double>(planted.size()), wanted, "motions");
    std::vector<Course> courses = DrawPlausibleCourses(key, first, kBatch, counts);
    const auto most = static_cast<std::size_t>(kPerMotion * wanted);
    if (courses.size() > most) courses.resize(most);
    if (courses.empty()) continue;
    for (PlantedCourse& found : SolveCourses(courses)) {
      ++counts->solved;
      if (std::ssize(planted) < wanted) planted.push_back(std::move(found));
    }
  }
  return planted;
}

}  // namespace legopt::worldgen
