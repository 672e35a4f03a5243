#include "legopt/geometry/collision_query.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <thread>

#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "tests/geometry/allocation_count.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

constexpr int kDofs = 4;

/// Trunk (two boxes) - upper arm (capsule) - forearm (cylinder) - ball (sphere) and a second arm (box) with all
/// primitives.
RobotModel ToyRobot() {
  const auto link = [](const std::string& name, int joint, std::vector<ShapeSpec> shapes) {
    Link l;
    l.name = name;
    l.mass = 1.0;
    l.parent_joint = joint;
    l.collision = std::move(shapes);
    return l;
  };
  const auto joint = [](const std::string& name, int parent, int child, const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& axis) {
    Joint j;
    j.name = name;
    j.type = JointType::kRevolute;
    j.parent_link = parent;
    j.child_link = child;
    j.origin = Eigen::Translation3d(origin);
    j.axis = axis;
    j.dof = child - 1;
    j.lower = -3.0;
    j.upper = 3.0;
    return j;
  };
  using Kind = ShapeSpec::Kind;
  std::vector<Link> links = {
      link("trunk", -1, {Spec(Kind::kBox, {0.3, 0.3, 0.4}), Spec(Kind::kBox, {0.2, 0.5, 0.1}, At(0, 0, 0.3))}),
      link("upper", 0, {Spec(Kind::kCapsule, {0.05, 0, 0.3}, At(0, 0, -0.15))}),
      link("fore", 1, {Spec(Kind::kCylinder, {0.05, 0, 0.3}, At(0, 0, -0.2))}),
      link("ball", 2, {Spec(Kind::kSphere, {0.08, 0, 0}, At(0, 0, -0.05))}),
      link("paddle", 3, {Spec(Kind::kBox, {0.3, 0.05, 0.2}, At(0.15, 0, 0))}),
  };
  std::vector<Joint> joints = {
      joint("shoulder", 0, 1, {0, 0.35, 0.3}, Eigen::Vector3d::UnitX()),
      joint("elbow", 1, 2, {0, 0, -0.35}, Eigen::Vector3d::UnitY()),
      joint("wrist", 2, 3, {0, 0, -0.4}, Eigen::Vector3d::UnitX()),
      joint("hinge", 0, 4, {0, -0.35, 0.3}, Eigen::Vector3d::UnitY()),
  };
  return RobotModel("toy", links, joints);
}

Scene ToyScene() {
  using Kind = ShapeSpec::Kind;
  Scene scene;
  scene.objects = {
      {"floor", Spec(Kind::kBox, {4, 4, 0.2}, At(0, 0, -0.9))},
      {"post", Spec(Kind::kCylinder, {0.2, 0, 2.0}, At(0.7, 0.3, 0))},
      {"ball", Spec(Kind::kSphere, {0.3, 0, 0}, At(-0.7, 0.4, 0.1))},
      {"rail", Spec(Kind::kCapsule, {0.1, 0, 1.0}, At(0, -0.9, 0) * Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX()))}};
  return scene;
}

Eigen::VectorXd DrawPosture(const RobotModel& robot, Draw& draw) {
  Eigen::VectorXd x = ZeroPose(robot);
  for (int i = 0; i < kDofs; ++i) x[i] = draw.Number(-2.5, 2.5);
  const Eigen::Isometry3d base = draw.Pose(0.3);
  const Eigen::Quaterniond q(base.linear());
  x.tail<7>() << base.translation(), q.w(), q.x(), q.y(), q.z();
  return x;
}

struct Fixture {
  RobotModel robot = ToyRobot();
  std::shared_ptr<const CollisionModel> model = CollisionModel::Build(robot, ToyScene(), ZeroPose(robot));
  Kinematics kinematics{robot};
};

std::vector<ProximityPair> Copy(std::span<const ProximityPair> contacts) { return {contacts.begin(), contacts.end()}; }

void ExpectSame(const std::vector<ProximityPair>& a, const std::vector<ProximityPair>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].pair_id, b[i].pair_id);
    EXPECT_EQ(a[i].link_a, b[i].link_a);
    EXPECT_EQ(a[i].link_b, b[i].link_b);
    EXPECT_EQ(a[i].distance_m, b[i].distance_m);
    EXPECT_EQ(a[i].point_a_W, b[i].point_a_W);
    EXPECT_EQ(a[i].point_b_W, b[i].point_b_W);
    EXPECT_EQ(a[i].normal_W, b[i].normal_W);
  }
}

TEST(CollisionQuery, ContactsObeyTheConventions) {
  Fixture f;
  CollisionQuery query(f.model);
  Draw draw(41);
  int scene = 0;
  int self = 0;
  for (int round = 0; round < 200; ++round) {
    f.kinematics.Update(DrawPosture(f.robot, draw));
    std::set<int> ids;
    std::tuple<int, int, int> last{-1, -1, -1};
    for (const ProximityPair& c : query.Contacts(f.kinematics, 0.1)) {
      EXPECT_LT(c.distance_m, 0.1);
      EXPECT_NEAR(c.normal_W.norm(), 1.0, 1e-12);
      EXPECT_LT((c.point_a_W - c.point_b_W - c.distance_m * c.normal_W).norm(), 1e-12);
      EXPECT_TRUE(ids.insert(c.pair_id).second) << "each pair once";
      if (c.link_b == kScene) {
        ++scene;
      } else {
        ++self;
        EXPECT_LT(c.link_a, c.link_b);
        EXPECT_EQ(f.model->pair_status(c.link_a, c.link_b), CollisionModel::PairStatus::kChecked);
      }
      const auto order = c.link_b == kScene ? std::tuple(0, c.link_a, 0) : std::tuple(1, c.link_b, c.link_a);
      EXPECT_LE(last, order);
      last = order;
    }
  }
  EXPECT_GT(scene, 200);
  EXPECT_GT(self, 50);
}

using Nearest = std::map<std::pair<int, int>, double>;  // key: (link, other link or scene)

void Consider(std::pair<int, int> pair, double distance_m, Nearest& nearest) {
  const auto [it, inserted] = nearest.try_emplace(pair, distance_m);
  it->second = std::min(it->second, distance_m);
}

/// Finds the nearest contacts by brute force: every shape against every other one.
Nearest OfAllPairs(const CollisionModel& model, const Kinematics& kinematics, double margin) {
  const CollisionModel::Impl& data = model.impl();
  Nearest nearest;
  const auto consider = [&](int a, int b, const SupportSet& sa, const SupportSet& sb) {
    PairDistance d;
    if (SignedDistance(sa, sb, margin, d)) Consider({a, b}, d.distance_m, nearest);
  };
  const auto place = [&](int link, PairResolution detail) {
    std::vector<std::unique_ptr<PlacedShape>> placed;
    const ShapeRun run = data.links[static_cast<size_t>(link)].Of(detail);
    for (int i = run.first; i < run.end(); ++i) {
      placed.push_back(std::make_unique<PlacedShape>(data.shapes[static_cast<size_t>(i)], kinematics.link_pose(link)));
    }
    return placed;
  };
  for (int a = 0; a < model.num_links(); ++a) {
    for (const auto& pa : place(a, PairResolution::kHulls)) {
      for (const SupportSet& solid : data.solid_sets) consider(a, kScene, pa->set(), solid);
    }
    for (int b = a + 1; b < model.num_links(); ++b) {
      if (model.pair_status(a, b) != CollisionModel::PairStatus::kChecked) continue;
      const PairResolution detail = data.pairs.detail[data.PairIndex(a, b)];
      const auto placed_b = place(b, detail);
      for (const auto& pa : place(a, detail)) {
        for (const auto& pb : placed_b) consider(a, b, pa->set(), pb->set());
      }
    }
  }
  return nearest;
}

void ExpectNearestOfAllPairs(CollisionQuery& query, const Kinematics& kinematics) {
  constexpr double kMargin = 0.08;
  Nearest nearest;
  for (const ProximityPair& c : query.Contacts(kinematics, kMargin)) {
    Consider({c.link_a, c.link_b}, c.distance_m, nearest);
  }
  const Nearest expected = OfAllPairs(query.model(), kinematics, kMargin);
  ASSERT_EQ(nearest.size(), expected.size());
  for (const auto& [pair, distance] : expected) {
    ASSERT_EQ(nearest.count(pair), 1U);
    EXPECT_NEAR(nearest.at(pair), distance, 1e-7);
  }
}

TEST(CollisionQuery, AgreesWithTestingAllPairsOfShapes) {
  Fixture f;
  CollisionQuery query(f.model);
  Draw draw(42);
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    f.kinematics.Update(DrawPosture(f.robot, draw));
    ExpectNearestOfAllPairs(query, f.kinematics);
  }
}

// Pelvis and utorso of the Atlas touch in the reference pose: an actuator of one link is in a hollow of the other,
// millimetres from its walls.
TEST(AtlasQuery, LinksMayReachIntoHollowsOfEachOther) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  CollisionQuery query(CollisionModel::Build(robot, {}, AtlasReference(robot), {.pairs = PairSelection::kAll}));
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  const int pelvis = robot.FindLink("pelvis"), utorso = robot.FindLink("utorso");
  Kinematics kinematics(robot);
  Draw draw(45);
  constexpr double kNoticeable = 1e-3;
  int apart = 0, inside = 0;
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(round);
    Eigen::VectorXd x = ZeroPose(robot);
    for (int i = 0; i < robot.num_dofs(); ++i) {
      x[i] = std::clamp(draw.Number(-0.3, 0.3), robot.lower_limits()[i], robot.upper_limits()[i]);
    }
    kinematics.Update(x);
    if (round % 6 == 0) ExpectNearestOfAllPairs(query, kinematics);
    meshes.Place(kinematics);
    const auto &a = meshes.geometry(pelvis, 0), &b = meshes.geometry(utorso, 0);
    const double depth = std::max(meshes.ExactDepth(a, b), meshes.InsideDepth(a, b));
    double distance = kBeyondAllDistances;
    for (const ProximityPair& c : query.Contacts(kinematics, 0.0)) {
      if (c.link_a == pelvis && c.link_b == utorso) distance = std::min(distance, c.distance_m);
    }
    if (depth > kNoticeable) {
      ++inside;
      EXPECT_LT(distance, 0.0) << depth;
    } else if (depth <= 0.0 && distance >= 0.0) {
      ++apart;
    }
  }
  EXPECT_GT(inside, 5);
  EXPECT_GT(apart, 30);  // none by hulls or by pieces of whole meshes
}

TEST(CollisionQuery, ResultsDoNotDependOnEarlierQueriesNorOnTheThread) {
  Fixture f;
  CollisionQuery used(f.model);
  Draw draw(43);
  for (int round = 0; round < 50; ++round) {
    f.kinematics.Update(DrawPosture(f.robot, draw));
    CollisionQuery fresh(f.model);
    const std::vector<ProximityPair> expected = Copy(fresh.Contacts(f.kinematics, 0.1));
    used.Contacts(f.kinematics, 0.5);
    ExpectSame(Copy(used.Contacts(f.kinematics, 0.1)), expected);
    std::vector<ProximityPair> elsewhere;
    std::thread([&] {
      CollisionQuery other(f.model);
      elsewhere = Copy(other.Contacts(f.kinematics, 0.1));
    }).join();
    ExpectSame(elsewhere, expected);
  }
}

TEST(CollisionQuery, AllocatesNothingAfterWarmUp) {
  Fixture f;
  CollisionQuery query(f.model);
  WarmStartCache memory;
  Draw draw(44);
  std::vector<Eigen::VectorXd> postures;
  for (int i = 0; i < 50; ++i) postures.push_back(DrawPosture(f.robot, draw));
  const auto run = [&] {
    for (const Eigen::VectorXd& x : postures) {
      f.kinematics.Update(x);
      query.Contacts(f.kinematics, 0.1);
      query.Contacts(f.kinematics, 0.1, &memory);
    }
  };
  run();
  const long before = AllocationCount();
  run();
  EXPECT_EQ(AllocationCount(), before);
}

// A walk in small steps with occasional leaps, so that the memory is either helpful or outdated.
TEST(CollisionQuery, MemoryChangesNoContact) {
  Fixture f;
  CollisionQuery query(f.model), with_memory(f.model);
  WarmStartCache memory;
  Draw draw(46);
  Eigen::VectorXd x = DrawPosture(f.robot, draw), dx(f.robot.tangent_size());
  size_t found = 0;
  for (int step = 0; step < 400; ++step) {
    if (step % 40 == 0) {
      x = DrawPosture(f.robot, draw);
    } else {
      for (Eigen::Index i = 0; i < dx.size(); ++i) dx[i] = draw.Number(-0.02, 0.02);
      Eigen::VectorXd next = x;
      Retract(x, dx, next);
      x = next;
    }
    f.kinematics.Update(x);
    const std::vector<ProximityPair> expected = Copy(query.Contacts(f.kinematics, 0.1));
    const std::vector<ProximityPair> contacts = Copy(with_memory.Contacts(f.kinematics, 0.1, &memory));
    ASSERT_EQ(contacts.size(), expected.size()) << step;
    for (size_t i = 0; i < contacts.size(); ++i) {
      EXPECT_EQ(contacts[i].pair_id, expected[i].pair_id);
      EXPECT_NEAR(contacts[i].distance_m, expected[i].distance_m, 2e-7);
    }
    found += contacts.size();
  }
  EXPECT_GT(found, 400U);
  EXPECT_GT(memory.size(), 4U);
}

TEST(WarmStartCache, BeginsAnewWhenItIsFull) {
  WarmStartCache memory;
  constexpr int kPairs = static_cast<int>(WarmStartCache::kMaxPairs), kApart = 64;
  for (int i = 0; i < kPairs; ++i) {
    EXPECT_EQ(memory.At(i * kApart).size, 0);
    memory.At(i * kApart).size = static_cast<std::uint8_t>(1 + i % 3);
  }
  for (int i = 0; i < kPairs; ++i) EXPECT_EQ(memory.At(i * kApart).size, 1 + i % 3) << i;
  EXPECT_EQ(memory.size(), WarmStartCache::kMaxPairs);
  EXPECT_EQ(memory.At(1).size, 0);  // one more than it holds
  EXPECT_EQ(memory.size(), 1U);
  EXPECT_EQ(memory.At(0).size, 0);
}

TEST(CollisionQuery, LargerMarginOnlyAddsContacts) {
  Fixture f;
  CollisionQuery query(f.model);
  Draw draw(45);
  for (int round = 0; round < 50; ++round) {
    f.kinematics.Update(DrawPosture(f.robot, draw));
    const std::vector<ProximityPair> small = Copy(query.Contacts(f.kinematics, 0.02));
    std::map<int, double> large;
    for (const ProximityPair& c : query.Contacts(f.kinematics, 0.1)) large[c.pair_id] = c.distance_m;
    for (const ProximityPair& c : small) {
      ASSERT_EQ(large.count(c.pair_id), 1U);
      EXPECT_NEAR(large.at(c.pair_id), c.distance_m, 1e-14);
    }
  }
}

/// Returns distances by pair at a configuration.
std::map<int, double> DistancesAt(CollisionQuery& query, Kinematics& kinematics, const Eigen::VectorXd& x,
                                  double margin) {
  kinematics.Update(x);
  std::map<int, double> result;
  for (const ProximityPair& c : query.Contacts(kinematics, margin)) result[c.pair_id] = c.distance_m;
  return result;
}

/// Compares n^T (J_A - J_B) with central differences of the distance. Entries where the two one-sided slopes differ
/// are ties, at which the witness points jump; they are skipped. Returns the number of compared entries.
int CompareWithDifferences(const RobotModel& robot, CollisionQuery& query, const Eigen::VectorXd& x, double margin) {
  constexpr double kStep = 1e-5;
  constexpr double kTie = 1e-3;
  Kinematics kinematics(robot);
  kinematics.Update(x);
  const std::vector<ProximityPair> contacts = Copy(query.Contacts(kinematics, margin));
  const int m = robot.tangent_size();
  std::vector<std::vector<double>> gradients;
  for (const ProximityPair& c : contacts) {
    std::vector<double>& row = gradients.emplace_back(static_cast<size_t>(m), 0.0);
    kinematics.AddPointGradient(c.link_a, c.point_a_W, c.normal_W, 1.0, row.data());
    if (c.link_b != kScene) kinematics.AddPointGradient(c.link_b, c.point_b_W, c.normal_W, -1.0, row.data());
  }
  int compared = 0;
  Kinematics moved(robot);
  for (int i = 0; i < m; ++i) {
    Eigen::VectorXd forward = x;
    Eigen::VectorXd backward = x;
    Retract(x, kStep * Eigen::VectorXd::Unit(m, i), forward);
    Retract(x, -kStep * Eigen::VectorXd::Unit(m, i), backward);
    const std::map<int, double> plus = DistancesAt(query, moved, forward, margin + 0.01);
    const std::map<int, double> minus = DistancesAt(query, moved, backward, margin + 0.01);
    for (size_t c = 0; c < contacts.size(); ++c) {
      const auto p = plus.find(contacts[c].pair_id);
      const auto q = minus.find(contacts[c].pair_id);
      if (p == plus.end() || q == minus.end()) continue;  // now repeats another contact
      const double ahead = (p->second - contacts[c].distance_m) / kStep;
      const double behind = (contacts[c].distance_m - q->second) / kStep;
      if (std::abs(ahead - behind) > kTie) continue;
      EXPECT_NEAR(0.5 * (ahead + behind), gradients[c][static_cast<size_t>(i)], kTie);
      ++compared;
    }
  }
  return compared;
}

TEST(LinearisedDistance, MeetsFiniteDifferencesOnPrimitives) {
  Fixture f;
  CollisionQuery query(f.model);
  Draw draw(46);
  int compared = 0;
  for (int round = 0; round < 60; ++round)
    compared += CompareWithDifferences(f.robot, query, DrawPosture(f.robot, draw), 0.1);
  EXPECT_GT(compared, 1500);
}

TEST(LinearisedDistance, MeetsFiniteDifferencesOnAtlasInTheGarage) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, Garage(), AtlasReference(robot));
  CollisionQuery query(model);
  int compared = 0;
  Draw draw(47);
  const auto stances = ReadStances(DataFolder() / "problemsposture.json");
  for (size_t s = 0; s < stances.size(); s += 4) {
    Eigen::VectorXd x = StandOn(robot, stances[s]);
    for (int i = 0; i < robot.num_dofs(); ++i) x[i] += draw.Number(-0.05, 0.05);  // away from symmetric ties
    compared += CompareWithDifferences(robot, query, x, 0.03);
  }
  EXPECT_GT(compared, 1000);
}

TEST(AtlasQuery, SolverIsNeitherBlockedNorBlindAtTheHips) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  CollisionQuery query(model);
  Kinematics kinematics(robot);
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  int touching = 0;
  int free = 0;
  for (const std::string side : {"l", "r"}) {
    const int uglut = robot.FindLink(side + "_uglut");
    const int uleg = robot.FindLink(side + "_uleg");
    const auto dof = [&](const std::string& joint) {
      return robot.joints()[static_cast<size_t>(robot.FindJoint(side + joint))].dof;
    };
    for (double pitch = -1.5; pitch < 0.53; pitch += 0.1) {
      for (const double roll : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
        Eigen::VectorXd x = ZeroPose(robot);
        x[dof("_leg_lhy")] = pitch;
        x[dof("_leg_mhx")] = roll;
        kinematics.Update(x);
        meshes.Place(kinematics);
        const bool meshes_touch = meshes.Depth(meshes.geometry(uglut, 0), meshes.geometry(uleg, 0)) >= 0.0;
        double depth = 0.0;
        for (const ProximityPair& c : query.Contacts(kinematics, 0.0)) {
          if (c.link_a == uglut && c.link_b == uleg) depth = std::max(depth, -c.distance_m);
        }
        ++(meshes_touch ? touching : free);
        if (meshes_touch) {
          EXPECT_GT(depth, 0.0) << side << " pitch " << pitch << " roll " << roll;
        }
        if (pitch < 0.1) {
          EXPECT_LT(depth, 1e-3) << side << " pitch " << pitch << " roll " << roll;
        }
      }
    }
  }
  EXPECT_GT(touching, 5);
  EXPECT_GT(free, 100);
}

}  // namespace
}  // namespace legopt::test
