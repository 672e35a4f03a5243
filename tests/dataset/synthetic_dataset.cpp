#include "tests/dataset/synthetic_dataset.h"

#include <cmath>
#include <string>

#include "legopt/dataset/internal/dataset_content.h"
#include "tests/dataset/test_data.h"

namespace legopt::test {
namespace {

std::string Box(const std::string& size, const std::string& xyz) {
  return "<collision><origin xyz='" + xyz + "'/><geometry><box size='" + size + "'/></geometry></collision>";
}

std::string LinkXml(const std::string& name, const std::string& mass, const std::string& com,
                    const std::string& collision) {
  return "<link name='" + name + "'><inertial><origin xyz='" + com + "'/><mass value='" + mass +
         "'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>" + collision + "</link>\n";
}

std::string JointXml(const std::string& name, const std::string& type, const std::string& parent,
                     const std::string& child, const std::string& xyz, const std::string& axis,
                     const std::string& limit) {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin xyz='" + xyz + "'/><axis xyz='" + axis + "'/>" +
         (limit.empty() ? "" : "<limit " + limit + " effort='100' velocity='10'/>") + "</joint>\n";
}

std::string RobotXml() {
  std::string xml = "<robot name='tiny'>\n";
  xml += LinkXml("trunk", "10", "0 0 0.15", Box("0.2 0.2 0.3", "0 0 0.15"));
  for (const std::string side : {"l", "r"}) {
    const std::string y = side == "l" ? "0.1" : "-0.1";
    xml += LinkXml(side + "_leg", "2", "0 0 -0.25", Box("0.06 0.06 0.4", "0 0 -0.25"));
    xml += LinkXml(side + "_foot", "1", "0.03 0 -0.03", Box("0.2 0.1 0.04", "0.03 0 -0.03"));
    xml +=
        JointXml(side + "_hip", "revolute", "trunk", side + "_leg", "0 " + y + " 0", "0 1 0", "lower='-1' upper='1'");
    xml += JointXml(side + "_ankle", "revolute", side + "_leg", side + "_foot", "0 0 -0.5", "0 1 0",
                    "lower='-1' upper='1'");
  }
  for (const std::string side : {"l", "r"}) {
    const std::string y = side == "l" ? "0.2" : "-0.2";
    xml += LinkXml(side + "_arm", "1.5", "0 0 -0.2", Box("0.04 0.06 0.4", "0 0 -0.2"));
    // Positive shoulder angles raise the arm sideways on both sides.
    xml += JointXml(side + "_shoulder", "revolute", "trunk", side + "_arm", "0 " + y + " 0.25",
                    side == "l" ? "1 0 0" : "-1 0 0", "lower='-0.6' upper='2'");
  }
  xml += LinkXml("head", "1", "0 0 0", Box("0.1 0.1 0.1", "0 0 0"));
  xml += JointXml("neck", "prismatic", "trunk", "head", "0 0 0.4", "0 0 1", "lower='0' upper='0.1'");
  xml += "<link name='lidar_link'/>\n" + JointXml("lidar", "continuous", "head", "lidar_link", "0 0 0.1", "0 0 1", "");
  xml += "<link name='camera'/>\n" + JointXml("camera_joint", "fixed", "head", "camera", "0.1 0 0", "0 0 1", "");
  return xml + "</robot>\n";
}

constexpr const char* kScene = R"(objects:
  - {name: ground, shape: box, size: [20, 20, 0.5], position: [0, 0, -0.25]}
  - {name: column, shape: box, size: [0.2, 0.2, 2], position: [0, 0.6, 1]}
  - {name: rock, shape: mesh, file: meshes/rock.obj, position: [5, 5, 1], scale: 0.5}
)";

constexpr const char* kRock = R"(v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
)";

constexpr const char* kPostures = R"({"robot": "tiny", "scenario": "yard", "task": "posture", "problems": [
 {"id": 0, "definition": ["l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,"]},
 {"id": 7, "definition": ["l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,"]}]}
)";

constexpr const char* kMotions = R"({"robot": "tiny", "scenario": "yard", "task": "motion", "problems": [
 {"id": 0, "definition": ["l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,",
  "l_foot,1 0 0 0 0 0.1 0 ,", "l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,"]}]}
)";

constexpr const char* kDataset = R"(# A dataset for tests.
format: legopt-dataset/1
name: tiny
robot: robot.urdf
scene: scene.yaml
problems:
  posture: problems-posture.json
  motion: problems-motion.json
feet: [l_foot, r_foot]
sole_offset_m: 0.051
nominal_posture: {l_hip: -0.3, r_hip: -0.3, l_ankle: 0.3, r_ankle: 0.3, neck: 5}
self_collision_reference: {l_shoulder: 0, r_shoulder: 0}
files: {}
# The end.
)";

}  // namespace

SyntheticFolder::SyntheticFolder(const std::filesystem::path& folder) : folder_(folder) {
  WriteText(folder_ / "robot.urdf", RobotXml());
  WriteText(folder_ / "scene.yaml", kScene);
  WriteText(folder_ / "meshes" / "rock.obj", kRock);
  WriteText(folder_ / "problems-posture.json", kPostures);
  WriteText(folder_ / "problems-motion.json", kMotions);
  WriteText(folder_ / "dataset.yaml", kDataset);
  WriteManifestHashes(folder_);
}

Eigen::VectorXd StandingUpright() { return Leaning(0); }

Eigen::VectorXd Leaning(double angle_rad) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kSyntheticDofs + 7);
  x[kLeftHip] = x[kRightHip] = angle_rad;
  x[kLeftAnkle] = x[kRightAnkle] = -angle_rad;
  x[kSyntheticDofs] = kSyntheticLeg_m * std::sin(angle_rad);
  x[kSyntheticDofs + 2] = kSyntheticSoleOffset_m + kSyntheticLeg_m * std::cos(angle_rad);
  x[kSyntheticDofs + 3] = 1;
  return x;
}

}  // namespace legopt::test
