// Policy: the forces of a page hold the robot: they balance weight and moments within the judge's tolerance, lie in
// their friction cones, and give the torques and the ratio that the page shows. Where nothing holds it, the page names
// the contact that slips, or the joint that is overloaded.
#include "client/page/page_holding.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "client/page/page_solutions.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/internal/waypoint_inspector.h"
#include "legopt/judge/solution_file.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/static_equilibrium.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

Vector3d Vector(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

/// Checks the forces of a posture by their definition.
class HeldPosture {
 public:
  HeldPosture(const Dataset& dataset, const Eigen::VectorXd& x)
      : dataset_(dataset), kinematics_(dataset.robot()), torques_(dataset.robot().num_dofs()) {
    kinematics_.Update(ClampedConfiguration(dataset.robot(), x));
    kinematics_.GravityTorques(dataset.gravity_m_s2(), torques_);
  }

  void Expect(const Json& holding) {
    for (const Json& contact : holding.at("contacts")) Add(contact);
    const double weight_N = dataset_.robot().total_mass() * dataset_.gravity_m_s2();
    const double tolerance = kBalanceTolerance * weight_N + 0.5;  // and what rounding takes
    EXPECT_LT((sum_N_ - weight_N * Vector3d::UnitZ()).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_LT(moment_Nm_.cwiseAbs().maxCoeff(), tolerance);
    double ratio = 0.0;
    for (int dof = 0; dof < dataset_.robot().num_dofs(); ++dof) {
      EXPECT_NEAR(holding.at("torques").at(static_cast<std::size_t>(dof)).get<double>(), torques_[dof], 0.3) << dof;
      const double limit = dataset_.robot().effort_limits()[dof];
      if (std::isfinite(limit) && limit > 0.0) ratio = std::max(ratio, std::abs(torques_[dof]) / limit);
    }
    EXPECT_NEAR(holding.at("torque_ratio").get<double>(), ratio, 5e-3);
  }

 private:
  void Add(const Json& contact) {
    const Contact& known = dataset_.contact(contact.at("contact").get<std::string>());
    const int n = dataset_.robot().num_dofs();
    Eigen::MatrixXd jacobian(3, n + 6);
    const Vector3d normal = Vector(contact.at("normal"));
    for (const Json& one : contact.at("forces")) {
      const Vector3d at = Vector(one.at("at")), force_N = Vector(one.at("force_N"));
      sum_N_ += force_N;
      moment_Nm_ += (at - kinematics_.com()).cross(force_N);
      kinematics_.PointJacobian(known.link_index, at, jacobian);
      torques_ -= jacobian.leftCols(n).transpose() * force_N;
      if (contact.at("friction").is_null()) {
        EXPECT_LE(force_N.cwiseAbs().maxCoeff(), std::sqrt(3.0) * known.max_force_N + 0.1);
        continue;
      }
      const double along_N = force_N.dot(normal);
      const double tangential_N = (force_N - along_N * normal).norm();
      EXPECT_GE(along_N, 0.0);  // 0: rounded
      EXPECT_LE(tangential_N, contact.at("friction").get<double>() * along_N + 0.3);
    }
  }

  const Dataset& dataset_;
  Kinematics kinematics_;
  Eigen::VectorXd torques_;
  Vector3d sum_N_ = Vector3d::Zero(), moment_Nm_ = Vector3d::Zero();
};

TEST(PageHolding, ForcesBalanceTheRobotInTheirConesAndGiveTheTorques) {
  const std::string folder = SourceFolder() + "/data/contacts-humanoid";
  const auto dataset = Dataset::Load(folder);
  WaypointInspector inspector(dataset);
  int held = 0;
  for (const SolvedProblem& solved : ReadSolutions(folder + "/solutions-posture.json").problems) {
    const Eigen::VectorXd& x = solved.solutions.at(0).waypoints.at(0);
    const Stance& stance = dataset->problem(Task::kPosture, solved.definition.id).stances.at(0);
    const Json findings = FindingsJson(inspector.At(stance, x), *dataset);
    const Json& holding = findings.at("holding");
    ASSERT_TRUE(holding.at("balanced").get<bool>()) << solved.definition.id;
    ++held;
    SCOPED_TRACE(solved.definition.id);
    HeldPosture(*dataset, x).Expect(holding);
    EXPECT_EQ(holding.at("overloaded").empty(), holding.at("torque_ratio").get<double>() <= kTorqueTolerance);
    // The ratio is the judge's.
    for (const Json& value : findings.at("values")) {
      if (value.at("check") == "torque") {
        EXPECT_NEAR(value.at("value").get<double>(), holding.at("torque_ratio").get<double>(), 1e-3);
      }
      EXPECT_FALSE(value.at("violated").get<bool>()) << value;
    }
  }
  EXPECT_GT(held, 10);
}

class PageHoldingOnFeet : public testing::Test {
 protected:
  Json Findings(const Eigen::VectorXd& x) {
    return FindingsJson(inspector_.At(dataset_->problem(Task::kPosture, 0).stances[0], x), *dataset_);
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  WaypointInspector inspector_{dataset_};
};

TEST_F(PageHoldingOnFeet, FeetHaveForcesAndAnEquilibriumPolygonOfTheirOwn) {
  const Json findings = Findings(test::StandingUpright());
  HeldPosture(*dataset_, test::StandingUpright()).Expect(findings["holding"]);
  EXPECT_EQ(findings["holding"]["contacts"].size(), 2u);
  EXPECT_GE(findings["holding"]["polygon"].size(), 4u);
  EXPECT_FALSE(findings["holding"].contains("com_direction"));
}

TEST_F(PageHoldingOnFeet, BeyondTheFeetTheRobotTipsForward) {
  const Json findings = Findings(test::Leaning(0.5));
  const Json& holding = findings["holding"];
  EXPECT_FALSE(holding["balanced"].get<bool>());
  EXPECT_FALSE(holding.contains("torques"));
  EXPECT_GT(holding["com_direction"][0].get<double>(), 0.1);
  EXPECT_LT(holding["com_direction"][2].get<double>(), 0.0);
  for (const Json& contact : holding["contacts"]) {
    EXPECT_TRUE(contact["forces"].empty());
    EXPECT_EQ(contact["collapse"]["movement"], "rests") << "the toes stay";
  }
}

/// Replaces a text in a file of the synthetic dataset and returns its findings for a posture.
Json FindingsWith(const std::string& file, const std::string& from, const std::string& to, const Eigen::VectorXd& x) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path());
  test::ReplaceInFile(synthetic.path() / file, from, to);
  WriteManifestHashes(synthetic.path());
  const auto dataset = Dataset::Load(synthetic.path());
  WaypointInspector inspector(dataset);
  return FindingsJson(inspector.At(dataset->problem(Task::kPosture, 0).stances[0], x), *dataset);
}

TEST(PageHolding, AnOverloadedJointIsNamedAndOnlyItsCheckFails) {
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kLeftShoulder] = 0.5;
  // The first joint with these limits is the left shoulder.
  const std::string limits = "lower='-0.6' upper='2' effort=";
  const Json findings = FindingsWith("robot.urdf", limits + "'100'", limits + "'1'", x);
  EXPECT_EQ(findings["holding"]["overloaded"], Json::array({test::kLeftShoulder}));
  EXPECT_GT(findings["holding"]["torque_ratio"].get<double>(), 1.3);
  for (const Json& value : findings["values"]) {
    EXPECT_EQ(value["violated"].get<bool>(), value["check"] == "torque") << value;
    if (value["check"] == "torque") {
      EXPECT_EQ(value["subject"], "l_shoulder");
    }
  }
}

TEST(PageHolding, OfATrapTheSlippingContactsAreNamed) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/contacts-humanoid/traps");
  WaypointInspector inspector(dataset);
  std::map<std::string, int> movements;
  for (const ProblemDefinition& problem : dataset->problems(Task::kPosture)) {
    const Eigen::VectorXd x = dataset->robot().NeutralConfiguration();
    const Json holding = FindingsJson(inspector.At(problem.stances[0], x), *dataset)["holding"];
    EXPECT_FALSE(holding["balanced"].get<bool>()) << problem.id;
    for (const Json& contact : holding["contacts"]) {
      const Json& collapse = contact.at("collapse");
      ++movements[collapse.at("movement").get<std::string>()];
      if (collapse.at("movement") != "slips") continue;
      EXPECT_NEAR(Vector(collapse.at("direction")).dot(Vector(contact.at("normal"))), 0.0, 1e-3) << "along the surface";
    }
  }
  EXPECT_GT(movements["slips"], 0);
}

}  // namespace
}  // namespace legopt::client
