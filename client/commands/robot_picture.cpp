#include "client/commands/robot_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "legopt/robot/robot_model.h"
#include "legopt/worldgen/internal/picture.h"

namespace legopt::client {
namespace {

using worldgen::Colour;

constexpr std::array<Colour, 2> kLinks = {{{196, 196, 190}, {160, 172, 184}}};  // alternate, to tell links apart
constexpr Colour kGround = {226, 222, 212}, kContact = {215, 40, 40}, kCentreOfMass = {40, 80, 215};

class RobotDrawing {
 public:
  explicit RobotDrawing(const StandingView& view) {
    for (const TriangleMesh& link : view.links) {
      for (const Eigen::Vector3d& vertex : link.vertices) box_.extend(vertex);
    }
    box_.extend(view.com);
    for (std::size_t link = 0; link < view.links.size(); ++link) Add(view.links[link], kLinks[link % kLinks.size()]);
    AddGround();
  }

  const worldgen::Drawing& drawing() const { return drawing_; }
  const Eigen::AlignedBox3d& box() const { return box_; }
  double size() const { return std::max(box_.sizes().maxCoeff(), 1e-3); }

 private:
  void Add(const TriangleMesh& mesh, const Colour& colour) {
    const int first = static_cast<int>(drawing_.mesh.vertices.size());
    drawing_.mesh.vertices.insert(drawing_.mesh.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& [a, b, c] : mesh.triangles) {
      drawing_.mesh.triangles.push_back({first + a, first + b, first + c});
      drawing_.colours.push_back(colour);
      drawing_.parts.push_back(part_);
    }
    ++part_;
  }

  /// A slab whose upper side is z = 0.
  void AddGround() {
    constexpr double kThickness = 0.01;  // relative to the robot's size
    ShapeSpec slab;
    slab.kind = ShapeSpec::Kind::kBox;
    slab.size = Eigen::Vector3d(2.0, 2.0, kThickness) * size();
    slab.pose.translation() << box_.center().x(), box_.center().y(), -0.5 * slab.size.z();
    Add(Tessellate(slab), kGround);
  }

  worldgen::Drawing drawing_;
  Eigen::AlignedBox3d box_;
  int part_ = 0;
};

/// Pixel (x to the right, y down) of a point.
Eigen::Vector2d Project(const worldgen::Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d forward = (camera.target - camera.eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d up = right.cross(forward);
  const Eigen::Vector3d offset = point - camera.eye;
  const double pixels = 0.5 * camera.height / (std::tan(0.5 * camera.field_of_view_rad) * offset.dot(forward));
  return {0.5 * camera.width + pixels * offset.dot(right), 0.5 * camera.height - pixels * offset.dot(up)};
}

/// Paints a line over the picture, with round ends.
void Paint(const worldgen::Camera& camera, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_pixels,
           const Colour& colour, worldgen::Picture* picture) {
  const Eigen::Vector2d start = Project(camera, from), along = Project(camera, to) - start;
  const Eigen::Vector2d low = start.cwiseMin(start + along).array() - radius_pixels;
  const Eigen::Vector2d high = start.cwiseMax(start + along).array() + radius_pixels;
  const auto within = [](double value, int size) { return static_cast<int>(std::clamp(value, 0.0, double{1} * size)); };
  for (int y = within(low.y(), picture->height); y < within(high.y() + 1.0, picture->height); ++y) {
    for (int x = within(low.x(), picture->width); x < within(high.x() + 1.0, picture->width); ++x) {
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const double t = std::clamp((pixel - start).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      if ((pixel - start - t * along).norm() > radius_pixels) continue;
      std::copy(colour.begin(), colour.end(),
                picture->rgb.begin() + std::ptrdiff_t{3} * (std::ptrdiff_t{picture->width} * y + x));
    }
  }
}

/// Paints contacts and centre of mass, which links hide, over the robot.
void PaintMarks(const worldgen::Camera& camera, const StandingView& view, worldgen::Picture* picture) {
  constexpr double kDot = 5.0, kLine = 1.0;  // pixels
  for (const std::vector<Eigen::Vector3d>& contact : view.contacts) {
    const double width = contact.size() == 1 ? kDot : kLine;
    for (std::size_t i = 0; i < contact.size(); ++i) {
      Paint(camera, contact[i], contact[(i + 1) % contact.size()], width, kContact, picture);
    }
  }
  Paint(camera, view.com, view.com, kDot, kCentreOfMass, picture);
  Paint(camera, view.com, {view.com.x(), view.com.y(), 0.0}, kLine, kCentreOfMass, picture);
}

}  // namespace

void WriteRobotPicture(const StandingView& view, const std::filesystem::path& file) {
  constexpr int kWidth = 480, kHeight = 600;
  constexpr double kDistance = 2.0;  // relative to the robot's size; the robot fills the picture
  const RobotDrawing robot(view);
  std::array<worldgen::Picture, 2> sides;
  for (std::size_t side = 0; side < sides.size(); ++side) {
    const Eigen::Vector3d direction = side == 0 ? Eigen::Vector3d(1.0, 0.0, 0.25) : Eigen::Vector3d(0.0, 1.0, 0.25);
    worldgen::Camera camera;
    camera.target = robot.box().center();
    camera.eye = camera.target + kDistance * robot.size() * direction.normalized();
    camera.width = kWidth;
    camera.height = kHeight;
    camera.shadow_size = 2 * kHeight;
    worldgen::Picture one = worldgen::Render(robot.drawing(), camera);
    PaintMarks(camera, view, &one);
    sides[side] = std::move(one);
  }
  worldgen::WritePng(file, worldgen::Beside(sides[0], sides[1]));
}

}  // namespace legopt::client
