#include "legopt/robot/urdf_tree.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr double kMinAxisNorm = 1e-6;

[[noreturn]] void Refuse(const CheckedUrdf& urdf, const std::string& field, const std::string& value,
                         const std::string& message, const std::string& fix) {
  throw InputError({urdf.source, field, value, message, fix});
}

/// Links and joints by their indices in the file.
struct TreeIndex {
  explicit TreeIndex(const CheckedUrdf& urdf) : joints_of(urdf.links.size()) {
    std::unordered_map<std::string, std::size_t> index;
    for (std::size_t i = 0; i < urdf.links.size(); ++i) index[urdf.links[i]] = i;
    for (const UrdfJointElement& joint : urdf.joints) {
      joints_of[index[joint.parent]].push_back(child.size());
      child.push_back(index[joint.child]);
    }
  }

  std::vector<std::vector<std::size_t>> joints_of;  ///< per parent link, in the order of the file
  std::vector<std::size_t> child;                   ///< child link of each joint
};

/// Returns the only link that is no joint's child.
std::size_t FindRoot(const CheckedUrdf& urdf, const TreeIndex& tree) {
  std::vector<bool> is_child(urdf.links.size(), false);
  for (const std::size_t link : tree.child) is_child[link] = true;
  const auto root = std::find(is_child.begin(), is_child.end(), false);
  if (root == is_child.end()) {
    Refuse(urdf, "<robot>", "", "every link is the child of a joint (a kinematic loop)",
           "remove the joint that closes the loop");
  }
  const auto second = std::find(root + 1, is_child.end(), false);
  const auto name = [&](auto place) { return urdf.links[static_cast<std::size_t>(place - is_child.begin())]; };
  if (second != is_child.end()) {
    Refuse(urdf, "link '" + name(second) + "'", "",
           "is not connected: the robot also has the root link '" + name(root) + "'",
           "connect it by a joint or remove it");
  }
  return static_cast<std::size_t>(root - is_child.begin());
}

class TreeBuilder {
 public:
  TreeBuilder(const CheckedUrdf& urdf, const UrdfContent& content, fs::path mesh_folder)
      : urdf_(urdf), content_(content), mesh_folder_(std::move(mesh_folder)), tree_(urdf) {}

  RobotModel Build() {
    AddLink(FindRoot(urdf_, tree_));
    return RobotModel(urdf_.robot, std::move(links_), std::move(joints_));
  }

 private:
  [[noreturn]] void Fail(const std::string& field, const std::string& value, const std::string& message,
                         const std::string& fix) const {
    Refuse(urdf_, field, value, message, fix);
  }

  void AddLink(std::size_t source) {
    const int index = static_cast<int>(links_.size());
    links_.push_back(Finished(content_.links[source]));
    for (const std::size_t j : tree_.joints_of[source]) {
      Joint joint = Finished(content_.joints[j]);
      joint.parent_link = index;
      joint.child_link = static_cast<int>(links_.size());
      joints_.push_back(std::move(joint));
      AddLink(tree_.child[j]);
    }
  }

  Link Finished(Link link) const {
    if (!(link.mass >= 0.0) || !std::isfinite(link.mass) || !link.com.allFinite()) {
      Fail("link '" + link.name + "': inertial", std::to_string(link.mass), "mass must be finite and not negative",
           "correct the mass and the origin");
    }
    for (ShapeSpec& shape : link.collision) {
      if (!shape.size.allFinite() || shape.size.minCoeff() <= 0.0 || !shape.pose.matrix().allFinite()) {
        Fail("link '" + link.name + "': collision", "", "sizes must be positive and finite", "correct the geometry");
      }
      if (shape.kind == ShapeSpec::Kind::kMesh) shape.mesh_file = ResolveMesh(shape.mesh_file, link.name);
    }
    return link;
  }

  Joint Finished(Joint joint) const {
    const std::string field = "joint '" + joint.name + "'";
    if (!joint.origin.matrix().allFinite()) Fail(field + ": origin", "", "is not finite", "correct the numbers");
    if (joint.type == JointType::kFixed) return joint;
    if (!joint.axis.allFinite() || !(joint.axis.norm() >= kMinAxisNorm)) {
      Fail(field + ": axis", "", "has no direction", "give a non-zero axis");
    }
    joint.axis.normalize();
    if (!(joint.lower <= joint.upper)) {
      Fail(field + ": limit", std::to_string(joint.lower) + " .. " + std::to_string(joint.upper),
           "lower must not exceed upper", "swap or correct the limits");
    }
    return joint;
  }

  std::string ResolveMesh(const std::string& name, const std::string& link) const {
    constexpr std::string_view kPackage = "package://";
    constexpr std::string_view kFile = "file://";
    std::error_code ignored;
    fs::path path;
    if (name.starts_with(kPackage)) {
      const fs::path inside = name.substr(kPackage.size());
      for (fs::path folder = fs::absolute(mesh_folder_).lexically_normal();; folder = folder.parent_path()) {
        path = folder / inside;
        if (fs::exists(path, ignored) || folder == folder.parent_path()) break;
      }
    } else {
      path = name.starts_with(kFile) ? fs::path(name.substr(kFile.size())) : fs::path(name);
      if (path.is_relative()) path = mesh_folder_ / path;
    }
    if (!fs::is_regular_file(path, ignored)) {
      Fail("link '" + link + "': mesh", name, "there is no such mesh file", "put it there or correct the filename");
    }
    return fs::absolute(path).lexically_normal().string();
  }

  const CheckedUrdf& urdf_;
  const UrdfContent& content_;
  fs::path mesh_folder_;
  TreeIndex tree_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
};

}  // namespace

void CheckUrdfTree(const CheckedUrdf& urdf) {
  const TreeIndex tree(urdf);
  const std::size_t root = FindRoot(urdf, tree);
  std::vector<bool> reached(urdf.links.size(), false);
  std::vector<std::size_t> open{root};
  while (!open.empty()) {
    const std::size_t link = open.back();
    open.pop_back();
    reached[link] = true;
    for (const std::size_t joint : tree.joints_of[link]) open.push_back(tree.child[joint]);
  }
  // With one root and at most one parent per link, a link that cannot be reached lies on a loop.
  const auto lost = std::find(reached.begin(), reached.end(), false);
  if (lost == reached.end()) return;
  Refuse(urdf, "link '" + urdf.links[static_cast<std::size_t>(lost - reached.begin())] + "'", "",
         "lies on a kinematic loop that is not connected to the root '" + urdf.links[root] + "'",
         "remove the joint that closes the loop");
}

RobotModel BuildUrdfTree(const CheckedUrdf& urdf, const UrdfContent& content, const std::string& mesh_folder) {
  return TreeBuilder(urdf, content, mesh_folder).Build();
}

}  // namespace legopt
