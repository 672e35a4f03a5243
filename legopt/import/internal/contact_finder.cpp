#include "legopt/import/internal/contact_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/ball.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/import/internal/lowest_ball.h"
#include "legopt/import/internal/touching_patch.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

constexpr double kClearance_m = 1e-3;   // clearance of the benchmark's foot targets
constexpr double kPlaneBand_m = 1e-3;   // corners this far above a facet's plane belong to it
constexpr double kReach_m = 2e-3;       // a sole reaches this near to the lowest point
constexpr double kFootBand = 0.06;      // share of the robot's height within which ends may be feet
constexpr double kWideFootBand = 0.15;  // this share, if only one end is within kFootBand
constexpr double kOtherSideBand = 0.4;  // this share, if all ends within kFootBand are on one side
constexpr std::size_t kMostPoints = 8;  // largest number of points of a patch
constexpr double kAligned_rad = std::numbers::pi / 180.0;
constexpr double kMicrometre = 1e-6, kPerMetre = 1e6;

std::vector<Eigen::Vector3d> PointsOf(const Link& link, const ReadGuard& guard) {
  std::vector<Eigen::Vector3d> points;
  for (const ShapeSpec& shape : link.collision) {
    const TriangleMesh mesh = Tessellate(shape, guard);
    points.insert(points.end(), mesh.vertices.begin(), mesh.vertices.end());
  }
  return points;
}

/// Bodies: links connected by fixed joints. Each is named by its first link.
class Bodies {
 public:
  explicit Bodies(const RobotModel& robot) : first_(robot.links().size()) {
    for (std::size_t link = 0; link < first_.size(); ++link) {
      const int joint = robot.links()[link].parent_joint;
      first_[link] = static_cast<int>(link);
      if (joint < 0) continue;
      const Joint& parent = robot.joints()[static_cast<std::size_t>(joint)];
      const int above = first_[static_cast<std::size_t>(parent.parent_link)];
      if (parent.type == JointType::kFixed) {
        first_[link] = above;
      } else {
        has_children_.push_back(above);
      }
    }
  }
  int of(int link) const { return first_[static_cast<std::size_t>(link)]; }
  /// True for the last body of a chain, and for a root from which only one chain leaves, which may also be a foot.
  bool IsEnd(int body) const { return std::ranges::count(has_children_, body) <= (body == 0 ? 1 : 0); }

 private:
  std::vector<int> first_;
  std::vector<int> has_children_;
};

/// Lowest point of an end of the robot.
struct End {
  int link = -1;  ///< the one that touches level ground
  Eigen::Vector3d lowest{0, 0, std::numeric_limits<double>::infinity()};
};

/// Returns the link of a body that touches level ground with the largest area; of equal ones, `lowest_link`. Sensors
/// and parts of a foot may be as low as its sole. A body that touches with three or more links, such as a foot on force
/// sensors, is named by its first link. `points`: per link of the body, in the world.
int TouchingLink(const std::map<int, std::vector<Eigen::Vector3d>>& points, int lowest_link, double lowest_m) {
  constexpr double kBand_m = 3e-3;
  int best = lowest_link;
  double largest_m2 = 0.0;
  int touching = 0;
  for (const auto& [link, all] : points) {
    std::vector<Eigen::Vector2d> low;
    for (const Eigen::Vector3d& p : all) {
      if (p.z() < lowest_m + kBand_m) low.emplace_back(p.head<2>());
    }
    touching += low.empty() ? 0 : 1;
    const double area_m2 = low.empty() ? 0.0 : PolygonArea(ConvexHull2d(std::move(low)));
    if (area_m2 <= largest_m2) continue;
    largest_m2 = area_m2;
    best = link;
  }
  constexpr int kSeveral = 3;
  return touching < kSeveral ? best : points.begin()->first;
}

/// Ends of a robot in one posture.
struct Ends {
  std::vector<End> all;  ///< ends with geometry, lowest first
  std::size_t feet = 0;  ///< the first ones are feet
  /// The body of the root link, which is no end, is as low as the feet: the robot lies, or its legs are stretched.
  bool lies = false;
};

/// Number of feet on the left minus that on the right.
std::ptrdiff_t Balance(const Ends& ends) {
  std::ptrdiff_t balance = 0;
  for (std::size_t i = 0; i < ends.feet; ++i) {
    const double left_m = ends.all[i].lowest.y();
    balance += left_m > kMicrometre ? 1 : left_m < -kMicrometre ? -1 : 0;
  }
  return balance;
}

Ends EndsAt(const RobotModel& robot, const Bodies& bodies, const std::vector<std::vector<Eigen::Vector3d>>& points,
            const Eigen::VectorXd& x) {
  Kinematics kinematics(robot);
  kinematics.UpdatePoses(x);
  std::map<int, End> by_body;
  std::map<int, std::map<int, std::vector<Eigen::Vector3d>>> placed;  // keys: body, link
  double low = std::numeric_limits<double>::infinity(), high = -low, low_root = low;
  for (int link = 0; link < std::ssize(robot.links()); ++link) {
    for (const Eigen::Vector3d& point : points[static_cast<std::size_t>(link)]) {
      const Eigen::Vector3d p = kinematics.link_pose(link) * point;
      low = std::min(low, p.z());
      high = std::max(high, p.z());
      if (!bodies.IsEnd(bodies.of(link))) {
        if (bodies.of(link) == 0) low_root = std::min(low_root, p.z());
        continue;
      }
      placed[bodies.of(link)][link].push_back(p);
      End& end = by_body[bodies.of(link)];
      if (p.z() < end.lowest.z()) end = {link, p};
    }
  }
  Ends ends;
  for (auto& [body, end] : by_body) {
    end.link = TouchingLink(placed[body], end.link, end.lowest.z());
    ends.all.push_back(end);
  }
  std::ranges::stable_sort(ends.all, {}, [](const End& end) { return end.lowest.z(); });
  const auto within = [&](double band) {
    return std::ranges::count_if(ends.all, [&](const End& end) { return end.lowest.z() <= low + band * (high - low); });
  };
  ends.lies = low_root <= low + kFootBand * (high - low);
  ends.feet = static_cast<std::size_t>(within(kFootBand) == 1 ? within(kWideFootBand) : within(kFootBand));
  if (ends.feet >= 2 && static_cast<std::size_t>(std::abs(Balance(ends))) == ends.feet) {
    Ends wider = ends;
    wider.feet = static_cast<std::size_t>(within(kOtherSideBand));
    if (Balance(wider) == 0) return wider;
  }
  return ends;
}

/// Configuration with all joints in the middle of their limits; 0 without limits.
Eigen::VectorXd Middle(const RobotModel& robot) {
  Eigen::VectorXd x = robot.NeutralConfiguration();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double middle = 0.5 * (robot.lower_limits()[dof] + robot.upper_limits()[dof]);
    if (std::isfinite(middle)) x[dof] = middle;
  }
  return x;
}

/// As many feet on the left as on the right are most plausible; then an even number; then two or more. A robot that
/// lies shows no feet.
int Plausibility(const Ends& ends) {
  if (ends.feet < 2 || ends.lies) return 0;
  if (ends.feet % 2 != 0) return 1;
  return Balance(ends) == 0 ? 3 : 2;
}

}  // namespace

FoundFeet FindFeet(const RobotModel& robot, const Eigen::VectorXd& standing) {
  const Bodies bodies(robot);
  std::vector<std::vector<Eigen::Vector3d>> points;
  for (const Link& link : robot.links()) points.push_back(PointsOf(link, robot.read_guard()));
  Ends ends = EndsAt(robot, bodies, points, standing);
  for (const Eigen::VectorXd& x : {robot.NeutralConfiguration(), Middle(robot)}) {
    if (const Ends other = EndsAt(robot, bodies, points, x); Plausibility(other) > Plausibility(ends)) ends = other;
  }
  FoundFeet found;
  const auto name = [&](const End& end) { return robot.links()[static_cast<std::size_t>(end.link)].name; };
  for (const End& end : ends.all) found.candidates.push_back(name(end));
  if (Plausibility(ends) == 0) return found;
  ends.all.resize(ends.feet);
  double front = -std::numeric_limits<double>::infinity(), rear = -front;
  for (const End& end : ends.all) {
    front = std::max(front, end.lowest.x());
    rear = std::min(rear, end.lowest.x());
  }
  // Feet within a tenth of the robot's length form a row.
  const double row_m = std::max(0.1 * (front - rear), kMicrometre);
  std::ranges::stable_sort(ends.all, [&](const End& a, const End& b) {
    const double row_a = std::round((front - a.lowest.x()) / row_m), row_b = std::round((front - b.lowest.x()) / row_m);
    return ends.all.size() > 2 && row_a != row_b ? row_a < row_b : a.lowest.y() > b.lowest.y();
  });
  for (const End& end : ends.all) found.links.push_back(name(end));
  return found;
}

namespace {

/// A plane facet of a hull: corners in a plane with an outward normal.
struct Facet {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0.0;  ///< normal . p + offset = 0 in the plane
  std::vector<Eigen::Vector3d> corners;
  double area_m2 = 0.0;
};

/// Rotation whose z axis is -normal and whose x axis is as near to `forward` as possible.
Eigen::Matrix3d AxesOf(const Eigen::Vector3d& normal, const Eigen::Vector3d& forward) {
  const Eigen::Vector3d z = -normal;
  Eigen::Vector3d x = forward - forward.dot(z) * z;
  if (x.norm() < 1e-3) x = z.unitOrthogonal();
  Eigen::Matrix3d R;
  R.col(2) = z;
  R.col(0) = x.normalized();
  R.col(1) = z.cross(R.col(0));
  return R;
}

std::vector<Eigen::Vector2d> Flattened(const std::vector<Eigen::Vector3d>& points, const Eigen::Matrix3d& axes) {
  std::vector<Eigen::Vector2d> flat;
  for (const Eigen::Vector3d& p : points) flat.emplace_back((axes.transpose() * p).head<2>());
  return ConvexHull2d(std::move(flat));
}

/// Returns true if a facet faces away from the joint that moves its body, as soles do; flanks of shins look sideways.
bool FacesAwayFrom(const Eigen::Vector3d& joint, const Facet& facet) {
  constexpr double kLeast = 0.35;  // cosine of 70 degrees
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : facet.corners) middle += corner / static_cast<double>(facet.corners.size());
  return facet.normal.dot(middle - joint) >= kLeast * (middle - joint).norm();
}

/// The facet with the largest area as seen from below; without corners if the hull is flat. `joint`: origin of the
/// body.
Facet LowestFacet(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up, double steepest_rad,
                  const Eigen::Vector3d& joint) {
  const ConvexHull hull = ComputeHull(points);
  Facet best;
  double best_score = 0.0, lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p : points) lowest = std::min(lowest, up.dot(p));
  const double least_down = std::cos(steepest_rad);
  for (const HalfSpace& plane : hull.facets) {
    const double down = -plane.normal.dot(up);
    if (down < least_down) continue;
    Facet facet{plane.normal, plane.offset, {}, 0.0};
    for (const Eigen::Vector3d& corner : hull.vertices) {
      if (plane.normal.dot(corner) + plane.offset > -kPlaneBand_m) facet.corners.push_back(corner);
    }
    const auto reaches_down = [&](const Eigen::Vector3d& p) { return up.dot(p) < lowest + kReach_m; };
    if (std::ranges::none_of(facet.corners, reaches_down)) continue;
    if (down < std::cos(kSteepestSole_rad) && !FacesAwayFrom(joint, facet)) continue;
    facet.area_m2 = PolygonArea(Flattened(facet.corners, AxesOf(plane.normal, Eigen::Vector3d::UnitX())));
    if (!(facet.area_m2 * down > best_score)) continue;
    best_score = facet.area_m2 * down;
    best = std::move(facet);
  }
  return best;
}

/// Omits corners, each time that with the smallest loss of area.
std::vector<Eigen::Vector2d> Simplified(std::vector<Eigen::Vector2d> polygon) {
  while (polygon.size() > kMostPoints) {
    const std::size_t n = polygon.size();
    std::size_t least = 0;
    double least_loss = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i) {
      const double loss = PolygonArea(std::array{polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]});
      if (loss < least_loss) {
        least = i;
        least_loss = loss;
      }
    }
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(least));
  }
  return polygon;
}

/// Rounds to micrometres; never -0.
double Rounded(double value) { return std::round(value * kPerMetre) / kPerMetre + 0.0; }

/// Returns the ball with the lowest point; nothing without balls.
std::optional<Ball> LowestOf(const std::vector<Ball>& balls, const Eigen::Vector3d& up) {
  if (balls.empty()) return {};
  return *std::ranges::min_element(balls, {}, [&](const Ball& ball) { return up.dot(ball.centre) - ball.radius_m; });
}

/// How balls carry a foot.
struct BallSupport {
  bool one = false;  ///< the lowest point belongs to a ball, whose tessellation has facets
  /// Corners of a sole between several balls, along the facet's normal; empty if they do not span one.
  std::vector<Eigen::Vector3d> corners;
};

BallSupport SupportOf(const std::vector<Ball>& balls, const Facet& facet, const Eigen::Vector3d& up) {
  BallSupport support;
  support.corners = facet.corners;
  std::vector<Eigen::Vector3d> bottoms;
  for (const Ball& ball : balls) {
    const Eigen::Vector3d p = ball.centre + ball.radius_m * facet.normal;
    if (facet.normal.dot(p) + facet.offset < -kPlaneBand_m) continue;
    std::erase_if(support.corners, [&](const Eigen::Vector3d& corner) {
      return std::abs((corner - ball.centre).norm() - ball.radius_m) <= kPlaneBand_m;
    });
    bottoms.push_back(p);
  }
  const bool sole_beside =
      PolygonArea(Flattened(support.corners, AxesOf(facet.normal, Eigen::Vector3d::UnitX()))) >= kFlatArea_m2;
  support.corners.insert(support.corners.end(), bottoms.begin(), bottoms.end());
  const double area_m2 = PolygonArea(Flattened(support.corners, AxesOf(facet.normal, Eigen::Vector3d::UnitX())));
  if (bottoms.size() < 2 || area_m2 < kFlatArea_m2) support.corners.clear();
  if (const std::optional<Ball> ball = LowestOf(balls, up)) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& corner : facet.corners) lowest = std::min(lowest, up.dot(corner));
    support.one =
        !sole_beside && support.corners.empty() && up.dot(ball->centre) - ball->radius_m <= lowest + kPlaneBand_m;
  }
  return support;
}

/// Foot seen along the normal of a facet of its hull.
struct FootView {
  std::vector<Eigen::Vector3d> corners;  ///< corners of the facet
  Eigen::Vector3d normal;                ///< outward normal of the facet
  Eigen::Vector3d forward;               ///< forward direction of the robot
  bool on_balls = false;                 ///< the corners are the lowest points of balls
  /// The foot's lowest points lie on one ball: then a facet that does not touch over its area, as between two bodies,
  /// is no sole.
  bool round = false;
};

/// Returns false if the facet is no sole. `underside`: returns the triangles of the foot in axes of the contact frame
/// at the link's origin.
template <class Underside>
bool DescribePatch(const FootView& foot, const Underside& underside, FoundSole* sole) {
  Eigen::Matrix3d axes = AxesOf(foot.normal, foot.forward);
  sole->tilt_rad = std::acos(std::clamp(axes(2, 2), -1.0, 1.0));
  if (Eigen::AngleAxisd(axes).angle() < kAligned_rad) axes.setIdentity();

  // Height of the lowest corner, so that no part of the sole is below the plane.
  double plane = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& corner : foot.corners) plane = std::min(plane, axes.col(2).dot(corner));
  std::vector<Eigen::Vector2d> patch = Simplified(Flattened(foot.corners, axes));
  if (!foot.on_balls) {
    const std::optional<std::vector<Eigen::Vector2d>> touching =
        TouchingPatch(patch, underside(axes), plane, !foot.round);
    if (!touching && foot.round) return false;
    if (touching) patch = Simplified(*touching);
  }
  sole->area_m2 = PolygonArea(patch);
  sole->height_m = -plane;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : patch) box.extend(corner);
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  if (box.exteriorDistance(origin) > 0.5 * box.sizes().maxCoeff()) origin = box.center();
  const Eigen::Vector3d in_axes(Rounded(origin.x()), Rounded(origin.y()), -Rounded(kClearance_m - plane));
  ContactDescription& contact = sole->contact;
  contact.position = axes.isIdentity(0.0) ? in_axes : Eigen::Vector3d(axes * in_axes);
  if (!axes.isIdentity(0.0)) contact.rpy_rad = RollPitchYaw(axes);
  contact.points.emplace();
  for (const Eigen::Vector2d& corner : patch) {
    contact.points->emplace_back(Rounded(corner.x() - in_axes.x()), Rounded(corner.y() - in_axes.y()),
                                 Rounded(plane - in_axes.z()));
  }
  return true;
}

/// `ball`: LowestBall of the foot.
void DescribePoint(Ball ball, const std::vector<Ball>& balls, const Eigen::Vector3d& up, FoundSole* sole) {
  const std::optional<Ball> shape = LowestOf(balls, up);
  const auto lowest = [&](const Ball& b) { return up.dot(b.centre) - b.radius_m; };
  if (shape && lowest(*shape) <= lowest(ball) + kPlaneBand_m) ball = *shape;
  sole->contact.kind = ContactKind::kPoint;
  sole->contact.position = ball.centre.unaryExpr(&Rounded);
  sole->contact.radius_m = Rounded(ball.radius_m);
  sole->height_m = -lowest(ball);
}

}  // namespace

FoundSole MeasureSole(const RobotModel& robot, int link, const Eigen::VectorXd& standing, double steepest_rad) {
  const Bodies bodies(robot);
  Kinematics kinematics(robot);
  kinematics.UpdatePoses(standing);
  const Eigen::Isometry3d X_LW = kinematics.link_pose(link).inverse(Eigen::Isometry);
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  std::vector<Ball> balls;
  for (int other = 0; other < std::ssize(robot.links()); ++other) {
    if (bodies.of(other) != bodies.of(link)) continue;
    const Link& part = robot.links()[static_cast<std::size_t>(other)];
    const Eigen::Isometry3d pose = X_LW * kinematics.link_pose(other);
    for (const ShapeSpec& shape : part.collision) {
      for (const Ball& ball : BallsOf(shape, pose)) balls.push_back(ball);
    }
    for (const ShapeSpec& shape : part.collision) {
      const TriangleMesh mesh = Tessellate(shape, robot.read_guard());
      for (const Eigen::Vector3d& p : mesh.vertices) points.push_back(pose * p);
      for (const std::array<int, 3>& t : mesh.triangles) {
        const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
          return pose * mesh.vertices[static_cast<std::size_t>(t.at(k))];
        };
        triangles.push_back({corner(0), corner(1), corner(2)});
      }
    }
  }
  FoundSole sole;
  sole.contact.name = sole.contact.link = robot.links()[static_cast<std::size_t>(link)].name;
  if (points.empty()) return sole;
  const Eigen::Vector3d up = X_LW.linear().col(2), forward = X_LW.linear().col(0);
  const Facet facet =
      LowestFacet(points, up, steepest_rad, (X_LW * kinematics.link_pose(bodies.of(link))).translation());
  const auto underside = [&](const Eigen::Matrix3d& axes) {
    Eigen::Isometry3d X_CL = Eigen::Isometry3d::Identity();
    X_CL.linear() = axes.transpose();
    TriangleColumns columns;
    for (int other = 0; other < std::ssize(robot.links()); ++other) {
      if (bodies.of(other) != bodies.of(link)) continue;
      for (const ShapeSpec& shape : robot.links()[static_cast<std::size_t>(other)].collision) {
        const TriangleMesh mesh = Tessellate(shape, robot.read_guard());
        for (int t = 0; t < std::ssize(mesh.triangles); ++t) {
          columns.Add(mesh, t, X_CL * X_LW * kinematics.link_pose(other));
        }
      }
    }
    return columns;
  };
  const Ball lowest = LowestBall(points, triangles, up);
  const BallSupport support = SupportOf(balls, facet, up);
  const FootView foot{.corners = support.corners.empty() ? facet.corners : support.corners,
                      .normal = facet.normal,
                      .forward = forward,
                      .on_balls = !support.corners.empty(),
                      .round = lowest.radius_m > 0.0};
  const bool flat = facet.area_m2 >= kFlatArea_m2 && !support.one;
  if (!flat || !DescribePatch(foot, underside, &sole)) DescribePoint(lowest, balls, up, &sole);
  return sole;
}

}  // namespace legopt
