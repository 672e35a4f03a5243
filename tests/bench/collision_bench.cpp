// Time budgets of the collision module. One full query of the robot against the garage and itself: at most 60 us,
// target 20 us (against the garage's triangles: 150 us). Judging one waypoint by exact meshes: at most 8 ms, target 1
// ms. Building a model: well under 2 s (of triangles: under 1 s).
#include <benchmark/benchmark.h>
#include <ode/ode.h>

#include <memory>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/ode_world.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/problem/terms/internal/transition_terms.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

/// Atlas in the garage with its contact patches at the contacts of the posture problems. Built once per program run.
struct World {
  RobotModel robot = Atlas();
  Scene scene = Garage();
  std::shared_ptr<const CollisionModel> model = CollisionModel::Build(robot, scene, AtlasReference(robot));
  std::shared_ptr<const CollisionModel> surface =
      CollisionModel::Build(robot, scene, AtlasReference(robot), {.scene = SceneRepresentation::kSurface});
  std::vector<Kinematics> standing;  ///< contact patches at the problem's contacts
  std::vector<Kinematics> lifted;    ///< good initial guess: 0.2 m higher
  std::vector<Kinematics> buried;    ///< initial guess in collision: 0.05 m lower

  World() {
    for (const auto& stance : ReadStances(DataFolder() / "problemsposture.json")) {
      Eigen::VectorXd x = StandOn(robot, stance);
      for (auto [list, lift] : {std::pair(&standing, 0.0), std::pair(&lifted, 0.2), std::pair(&buried, -0.25)}) {
        x[robot.num_dofs() + 2] += lift;
        list->emplace_back(robot).Update(x);
      }
    }
  }
};

/// Returns null and marks the benchmark as failed if the test data are missing.
const World* SharedWorld(benchmark::State& state) {
  if (!std::filesystem::exists(GarageFile())) {
    state.SkipWithError("test data missing (set LEGOPT_TEST_DATA)");
    return nullptr;
  }
  static const World world;
  return &world;
}

void RunQuery(benchmark::State& state, std::vector<Kinematics> World::*postures,
              std::shared_ptr<const CollisionModel> World::*model = &World::model) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  CollisionQuery query(world->*model);
  const double margin = 1e-3 * static_cast<double>(state.range(0));
  const std::vector<Kinematics>& list = world->*postures;
  size_t i = 0;
  size_t contacts = 0;
  for (auto _ : state) {
    contacts += query.Contacts(list[i], margin).size();
    i = (i + 1) % list.size();
  }
  state.counters["contacts"] = benchmark::Counter(static_cast<double>(contacts), benchmark::Counter::kAvgIterations);
}

void BM_QueryStanding(benchmark::State& state) { RunQuery(state, &World::standing); }
void BM_QueryGoodStart(benchmark::State& state) { RunQuery(state, &World::lifted); }
void BM_QueryInCollision(benchmark::State& state) { RunQuery(state, &World::buried); }
BENCHMARK(BM_QueryStanding)->Arg(0)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_QueryGoodStart)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_QueryInCollision)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);

void BM_SurfaceStanding(benchmark::State& state) { RunQuery(state, &World::standing, &World::surface); }
void BM_SurfaceGoodStart(benchmark::State& state) { RunQuery(state, &World::lifted, &World::surface); }
void BM_SurfaceInCollision(benchmark::State& state) { RunQuery(state, &World::buried, &World::surface); }
BENCHMARK(BM_SurfaceStanding)->Arg(0)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_SurfaceGoodStart)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_SurfaceInCollision)->Arg(30)->Arg(50)->ArgName("margin_mm")->Unit(benchmark::kMicrosecond);

/// Judges by the original evaluator's rule and by every listed pair; with `solid`, by the solid rule as well.
void RunJudge(benchmark::State& state, std::vector<Kinematics> World::*postures, bool solid) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  ExactCollision exact(world->robot, world->scene, world->model);
  const std::vector<Kinematics>& list = world->*postures;
  size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(exact.EnvironmentDepth(list[i]));
    benchmark::DoNotOptimize(exact.SelfDepth(list[i]));
    if (solid) {
      benchmark::DoNotOptimize(exact.DeepestIgnoredContact(list[i]));
      benchmark::DoNotOptimize(exact.DeepestContainment(list[i]));
      benchmark::DoNotOptimize(exact.LongestStep(list[i], list[(i + 1) % list.size()]));
    }
    i = (i + 1) % list.size();
  }
}

void BM_JudgeStanding(benchmark::State& state) { RunJudge(state, &World::standing, state.range(0) != 0); }
void BM_JudgeInCollision(benchmark::State& state) { RunJudge(state, &World::buried, state.range(0) != 0); }
BENCHMARK(BM_JudgeStanding)->Arg(0)->Arg(1)->ArgName("solid")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_JudgeInCollision)->Arg(0)->Arg(1)->ArgName("solid")->Unit(benchmark::kMicrosecond);

/// Evaluates one transition. Feet and trunk move between postures of successive stances of a motion, which takes up to
/// ten sub-steps. The contacts of both end points are computed beforehand.
void RunSwept(benchmark::State& state, std::shared_ptr<const CollisionModel> World::*model, bool linearize) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  constexpr size_t kTransitions = 24;
  CollisionQuery query(world->*model);
  std::vector<Eigen::VectorXd> x;
  for (const auto& stance : ReadStances(DataFolder() / "problemsmotion.json")) {
    if (x.size() > kTransitions) break;
    x.push_back(StandOn(world->robot, stance));
  }
  constexpr double kRange_m = 0.03;
  WaypointState from(world->robot, query, kRange_m);
  WaypointState to(world->robot, query, kRange_m);
  SweptCollisionTerm term(0, from, to, world->robot, query, 5e-4, kRange_m);
  std::vector<double> residuals;
  LinearModel linear;
  size_t t = 0;
  double rows = 0.0;
  for (auto _ : state) {
    state.PauseTiming();
    from.Update(x[t]);
    to.Update(x[t + 1]);
    from.contacts();
    to.contacts();
    residuals.clear();
    state.ResumeTiming();
    term.Evaluate(residuals);
    if (linearize) term.Linearize(linear);
    rows += static_cast<double>(residuals.size());
    t = (t + 1) % kTransitions;
  }
  state.counters["rows"] = benchmark::Counter(rows, benchmark::Counter::kAvgIterations);
}

void BM_SweptSolid(benchmark::State& state) { RunSwept(state, &World::model, state.range(0) != 0); }
void BM_SweptSurface(benchmark::State& state) { RunSwept(state, &World::surface, state.range(0) != 0); }
BENCHMARK(BM_SweptSolid)->Arg(0)->Arg(1)->ArgName("linearize")->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_SweptSurface)->Arg(0)->Arg(1)->ArgName("linearize")->Unit(benchmark::kMicrosecond);

void BM_BuildModel(benchmark::State& state) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  for (auto _ : state) {
    benchmark::DoNotOptimize(CollisionModel::Build(world->robot, world->scene, AtlasReference(world->robot)));
  }
  state.counters["solids"] = world->model->num_scene_solids();
}
BENCHMARK(BM_BuildModel)->Unit(benchmark::kMillisecond);

void BM_BuildSurface(benchmark::State& state) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  for (auto _ : state) {
    benchmark::DoNotOptimize(CollisionModel::Build(world->robot, world->scene, AtlasReference(world->robot),
                                                   {.scene = SceneRepresentation::kSurface}));
  }
  state.counters["triangles"] = world->surface->num_scene_solids();
}
BENCHMARK(BM_BuildSurface)->Unit(benchmark::kMillisecond);

void BM_NewQuery(benchmark::State& state) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  for (auto _ : state) CollisionQuery query(world->model);
}
BENCHMARK(BM_NewQuery)->Unit(benchmark::kMicrosecond);

/// Two hulls of 60 points with a radius of about 17 cm. Argument: distance of their centres in centimetres.
void BM_SignedDistance(benchmark::State& state) {
  Draw draw(1);
  const ConvexShape hull_a = ConvexShape::FromHull(draw.RandomHull(200, {0.1, 0.1, 0.1}));
  const ConvexShape hull_b = ConvexShape::FromHull(draw.RandomHull(200, {0.1, 0.1, 0.1}));
  std::vector<std::unique_ptr<PlacedShape>> placed;
  constexpr int kPoses = 64;
  for (int i = 0; i < kPoses; ++i) {
    const Eigen::Isometry3d turn = draw.Pose(0.0);
    placed.push_back(std::make_unique<PlacedShape>(hull_a, turn));
    placed.push_back(std::make_unique<PlacedShape>(
        hull_b, Eigen::Translation3d(draw.Vector(1.0).normalized() * 0.01 * static_cast<double>(state.range(0))) *
                    draw.Pose(0.0)));
  }
  PairDistance result;
  size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(SignedDistance(placed[i]->set(), placed[i + 1]->set(), 0.03, result));
    i = (i + 2) % placed.size();
  }
}
BENCHMARK(BM_SignedDistance)
    ->Arg(5)
    ->Arg(15)
    ->Arg(20)
    ->Arg(22)
    ->Arg(40)
    ->ArgName("centres_cm")
    ->Unit(benchmark::kNanosecond);

/// Queries one box of the robot's size against the garage's solids in each of ODE's spaces. OdeConvexWorld's choice of
/// a space is based on this benchmark.
void BM_Broadphase(benchmark::State& state) {
  const World* world = SharedWorld(state);
  if (world == nullptr) return;
  UseOdeOnThisThread();
  const dVector3 centre = {0, 0, 6, 0};
  const dVector3 half = {60, 40, 10, 0};
  dSpaceID space = nullptr;
  switch (state.range(0)) {
    case 0:
      space = dSimpleSpaceCreate(nullptr);
      break;
    case 1:
      space = dHashSpaceCreate(nullptr);
      break;
    case 2:
      space = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
      break;
    default:
      space = dQuadTreeSpaceCreate(nullptr, centre, half, static_cast<int>(state.range(0)));
  }
  for (const ConvexShape& solid : world->model->impl().solids) {
    const Eigen::Vector3d size = solid.bounds().sizes().cwiseMax(1e-6);
    dGeomID box = dCreateBox(space, size.x(), size.y(), size.z());
    const Eigen::Vector3d middle = solid.bounds().center();
    dGeomSetPosition(box, middle.x(), middle.y(), middle.z());
  }
  dGeomID region = dCreateBox(nullptr, 1.0, 1.0, 1.9);
  int found = 0;
  size_t i = 0;
  for (auto _ : state) {
    const Eigen::Vector3d& com = world->standing[i].com();
    dGeomSetPosition(region, com.x(), com.y(), com.z());
    dSpaceCollide2(region, reinterpret_cast<dGeomID>(space), &found,
                   [](void* data, dGeomID, dGeomID) { ++*static_cast<int*>(data); });
    i = (i + 1) % world->standing.size();
  }
  state.counters["found"] = benchmark::Counter(found, benchmark::Counter::kAvgIterations);
  dGeomDestroy(region);
  dSpaceDestroy(space);
}
BENCHMARK(BM_Broadphase)
    ->Arg(0)
    ->Arg(1)
    ->Arg(2)
    ->Arg(5)
    ->Arg(6)
    ->Arg(7)
    ->Arg(8)
    ->ArgName("space")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace legopt::test
