#include "legopt/geometry/collision_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "legopt/types/input_error.h"
#include "tests/folders.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

using PairStatus = CollisionModel::PairStatus;

TEST(AtlasModel, LinkPairsAreThoseOfTheReference) {
  const std::filesystem::path csv = std::filesystem::path(ReferenceFolder()) / "atlas-self-pairs.csv";
  LEGOPT_REQUIRE_FILE(csv);
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  const std::map<std::string, PairStatus> names = {{"checked", PairStatus::kChecked},
                                                   {"ignored_adjacent", PairStatus::kIgnoredAdjacent},
                                                   {"ignored_initial_overlap", PairStatus::kIgnoredReferencePose}};
  std::map<PairStatus, int> count;
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream fields(line);
    std::string a;
    std::string b;
    std::string status;
    std::getline(fields, a, ',');
    std::getline(fields, b, ',');
    std::getline(fields, status, ',');
    const PairStatus actual = model->pair_status(robot.FindLink(a), robot.FindLink(b));
    EXPECT_EQ(actual, names.at(status)) << line;
    EXPECT_EQ(actual, model->pair_status(robot.FindLink(b), robot.FindLink(a)));
    ++count[actual];
  }
  EXPECT_EQ(count[PairStatus::kIgnoredAdjacent], 36);
  EXPECT_EQ(count[PairStatus::kIgnoredReferencePose], 7);
  EXPECT_EQ(count[PairStatus::kChecked], 453);
  EXPECT_EQ(model->checked_pairs().size(), 453U);
  for (size_t i = 0; i + 1 < model->checked_pairs().size(); ++i) {
    const LinkPair& p = model->checked_pairs()[i];
    const LinkPair& q = model->checked_pairs()[i + 1];
    EXPECT_LT(std::pair(p.second, p.first), std::pair(q.second, q.first));
    EXPECT_LT(p.first, p.second);
  }
}

TEST(AtlasModel, HipPairsWhosHullsAlwaysOverlapAreDecomposed) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  for (const std::string side : {"l", "r"}) {
    const LinkPair pair(robot.FindLink(side + "_uglut"), robot.FindLink(side + "_uleg"));
    EXPECT_NE(std::find(model->decomposed_pairs().begin(), model->decomposed_pairs().end(), pair),
              model->decomposed_pairs().end())
        << side;
  }
  EXPECT_LT(model->decomposed_pairs().size(), 12U);
}

/// base - (fixed) - tip; base - shoulder - arm - elbow - hand, boxes of 0.2 m, 0.3 m apart along x.
std::string ChainUrdf() {
  const auto link = [](const std::string& name, const std::string& geometry) {
    return "<link name='" + name +
           "'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>" +
           (geometry.empty() ? "" : "<collision><geometry>" + geometry + "</geometry></collision>") + "</link>";
  };
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& child) {
    return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
           "'/><origin xyz='0.3 0 0'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>";
  };
  const std::string box = "<box size='0.2 0.2 0.2'/>";
  return "<robot name='chain'>" + link("base", box) + link("arm", box) + link("hand", box) + link("tip", box) +
         link("bare", "") + joint("shoulder", "revolute", "base", "arm") + joint("elbow", "revolute", "arm", "hand") +
         joint("weld", "fixed", "hand", "tip") + joint("wire", "revolute", "tip", "bare") + "</robot>";
}

RobotModel Chain() { return RobotModel::FromUrdfText(ChainUrdf(), "chain.urdf", "."); }

TEST(LinkPairs, AdjacencyCountsMovingJoints) {
  const RobotModel robot = Chain();
  const auto model = CollisionModel::Build(robot, {}, ZeroPose(robot));
  const int base = robot.FindLink("base");
  const int arm = robot.FindLink("arm");
  const int hand = robot.FindLink("hand");
  const int tip = robot.FindLink("tip");
  const int bare = robot.FindLink("bare");
  EXPECT_EQ(model->pair_status(base, arm), PairStatus::kIgnoredAdjacent);
  EXPECT_EQ(model->pair_status(arm, tip), PairStatus::kIgnoredAdjacent);  // a fixed joint does not count
  EXPECT_EQ(model->pair_status(hand, tip), PairStatus::kIgnoredAdjacent);
  EXPECT_EQ(model->pair_status(base, hand), PairStatus::kChecked);
  EXPECT_EQ(model->pair_status(base, tip), PairStatus::kChecked);
  for (int link : {base, arm, hand, tip}) EXPECT_EQ(model->pair_status(bare, link), PairStatus::kIgnoredAdjacent);
  EXPECT_EQ(model->num_link_pieces(bare), 0);
  EXPECT_EQ(model->num_link_pieces(arm), 1);
}

TEST(LinkPairs, TouchingInTheReferencePoseIsIgnoredForGood) {
  const RobotModel robot = Chain();
  Eigen::VectorXd folded = ZeroPose(robot);
  folded[0] = 2.9;  // the hand lies across the base
  const auto model = CollisionModel::Build(robot, {}, folded);
  EXPECT_EQ(model->pair_status(robot.FindLink("base"), robot.FindLink("hand")), PairStatus::kIgnoredReferencePose);
}

// The original evaluator ignores every pair that touches in one pose; the solid rule ignores only pairs that no
// pose separates.
TEST(LinkPairs, PhysicalRuleUsesAllSeparablePairs) {
  const RobotModel robot = Chain();
  Eigen::VectorXd folded = ZeroPose(robot);
  folded[0] = 2.9;
  const LinkPair pair(robot.FindLink("base"), robot.FindLink("hand"));
  const auto reference = CollisionModel::Build(robot, {}, folded);
  const auto all = CollisionModel::Build(robot, {}, folded, {.pairs = PairSelection::kAll});
  for (const CollisionModel* model : {reference.get(), all.get()}) {
    const auto& without = model->pairs(PairSelection::kReference);
    const auto& with = model->pairs(PairSelection::kAll);
    EXPECT_EQ(std::count(without.begin(), without.end(), pair), 0);
    EXPECT_EQ(std::count(with.begin(), with.end(), pair), 1);
    EXPECT_TRUE(std::is_sorted(with.begin(), with.end(), [](const LinkPair& a, const LinkPair& b) {
      return std::pair(a.second, a.first) < std::pair(b.second, b.first);
    }));
  }
  EXPECT_EQ(reference->checked_pairs(), reference->pairs(PairSelection::kReference));
  EXPECT_EQ(all->checked_pairs(), all->pairs(PairSelection::kAll));
  EXPECT_EQ(all->pair_status(pair.first, pair.second), PairStatus::kChecked);
}

/// base - hinge - (joint of +-0.01 rad) - flap, where the flap's box of `size` is inside the base's box.
RobotModel Hinged(const Eigen::Vector3d& size) {
  std::vector<Link> links(3);
  std::vector<Joint> joints(2);
  const char* const names[] = {"base", "hinge", "flap"};
  for (size_t i = 0; i < links.size(); ++i) {
    links[i].name = names[i];
    links[i].mass = 1.0;
    links[i].parent_joint = static_cast<int>(i) - 1;
  }
  links[0].collision = {Spec(ShapeSpec::Kind::kBox, {0.2, 0.2, 0.2})};
  links[2].collision = {Spec(ShapeSpec::Kind::kBox, size)};
  for (int i = 0; i < 2; ++i) {
    Joint& joint = joints[static_cast<size_t>(i)];
    joint.name = "joint" + std::to_string(i);
    joint.type = JointType::kRevolute;
    joint.parent_link = i;
    joint.child_link = i + 1;
    joint.axis = Eigen::Vector3d::UnitZ();
    joint.dof = i;
    joint.lower = -0.01;
    joint.upper = 0.01;
  }
  return RobotModel("hinged", links, joints);
}

TEST(LinkPairs, InseparablePairsAreIgnored) {
  const LinkPair pair(0, 2);
  for (const Eigen::Vector3d& size : {Eigen::Vector3d(0.5, 0.1, 0.1), Eigen::Vector3d(0.05, 0.06, 0.07)}) {
    const RobotModel robot = Hinged(size);
    const auto model = CollisionModel::Build(robot, {}, ZeroPose(robot), {.pairs = PairSelection::kAll});
    EXPECT_TRUE(model->pairs(PairSelection::kAll).empty()) << size.transpose();
    EXPECT_EQ(model->pair_status(0, 2), PairStatus::kIgnoredInseparable);
  }
  // The flap is entirely inside, so the surfaces never meet: the original evaluator checks the pair without effect.
  const RobotModel inside = Hinged({0.05, 0.06, 0.07});
  const auto model = CollisionModel::Build(inside, {}, ZeroPose(inside));
  EXPECT_EQ(model->checked_pairs(), std::vector<LinkPair>{pair});
}

TEST(AtlasModel, PhysicalRuleComparesAllButThreePairs) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot), {.pairs = PairSelection::kAll});
  EXPECT_EQ(model->checked_pairs().size(), 457U);
  const auto status = [&](const char* a, const char* b) {
    return model->pair_status(robot.FindLink(a), robot.FindLink(b));
  };
  for (const char* other : {"mtorso", "l_lglut", "r_lglut"})
    EXPECT_EQ(status("pelvis", other), PairStatus::kIgnoredInseparable);
  for (const char* other : {"utorso", "l_uleg", "r_uleg"}) EXPECT_EQ(status("pelvis", other), PairStatus::kChecked);
  EXPECT_EQ(status("l_uleg", "r_uleg"), PairStatus::kChecked);
}

TEST(BadInput, IsRefusedWithTheNameOfLinkObjectOrOption) {
  const RobotModel robot = Chain();
  const auto error_of = [&](const RobotModel& r, const Scene& scene, const Eigen::VectorXd& x,
                            const CollisionOptions& options) {
    try {
      CollisionModel::Build(r, scene, x, options);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Eigen::VectorXd good = ZeroPose(robot);
  EXPECT_NE(error_of(robot, {}, good.head(5), {}).find("configuration"), std::string::npos);
  Eigen::VectorXd bad = good;
  bad[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(robot, {}, bad, {}).find("finite"), std::string::npos);
  CollisionOptions options;
  options.link_concavity_m = 0.0;
  EXPECT_NE(error_of(robot, {}, good, options).find("link_concavity_m"), std::string::npos);
  options = {};
  options.max_component_pieces = 100;
  EXPECT_NE(error_of(robot, {}, good, options).find("max_component_pieces"), std::string::npos);

  Scene scene;
  scene.objects.push_back({"crate", {}});
  scene.objects[0].shape.size = {1.0, -1.0, 1.0};
  EXPECT_NE(error_of(robot, scene, good, {}).find("scene object 'crate'"), std::string::npos);
  scene.objects[0].shape.kind = ShapeSpec::Kind::kMesh;
  scene.objects[0].shape.mesh_file = "/nowhere/crate.stl";
  EXPECT_NE(error_of(robot, scene, good, {}).find("scene object 'crate'"), std::string::npos);

  std::vector<Link> links = robot.links();
  links[1].collision[0].kind = ShapeSpec::Kind::kMesh;
  links[1].collision[0].mesh_file = "/nowhere/arm.stl";
  const RobotModel broken("chain", links, robot.joints());
  EXPECT_NE(error_of(broken, {}, good, {}).find("link 'arm'"), std::string::npos);
}

TEST(SceneContains, KnowsPrimitivesAndTheirDepth) {
  const RobotModel robot = Chain();
  Scene scene;
  scene.objects.push_back({"ball", {}});
  scene.objects[0].shape.kind = ShapeSpec::Kind::kSphere;
  scene.objects[0].shape.size = {1.0, 0.0, 0.0};
  scene.objects[0].shape.pose.translation() = Eigen::Vector3d(5, 0, 0);
  const auto model = CollisionModel::Build(robot, scene, ZeroPose(robot));
  EXPECT_EQ(model->num_scene_solids(), 1);
  EXPECT_TRUE(model->SceneContains({5.5, 0, 0}));
  EXPECT_TRUE(model->SceneContains({5.5, 0, 0}, 0.49));
  EXPECT_FALSE(model->SceneContains({5.5, 0, 0}, 0.51));
  EXPECT_FALSE(model->SceneContains({6.01, 0, 0}));
}

}  // namespace
}  // namespace legopt::test
