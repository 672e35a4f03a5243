#include "legopt/worldgen/internal/picture.h"

#include <png.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/types/input_error.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSamples = 2;  // samples per pixel along each axis

/// Depth buffer with the visible triangle of each sample.
struct Buffer {
  int width, height;
  std::vector<float> depth;  ///< smaller is nearer
  std::vector<int> triangle;

  Buffer(int w, int h)
      : width(w),
        height(h),
        depth(static_cast<size_t>(w) * static_cast<size_t>(h), std::numeric_limits<float>::infinity()),
        triangle(depth.size(), -1) {}

  size_t At(int x, int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x); }
};

/// View transform. Eye coordinates: x right, y up, z forward.
struct View {
  Eigen::Matrix3d axes;  ///< eye axes as rows
  Vector3d eye;
  View(const Vector3d& from, const Vector3d& to) : eye(from) {
    const Vector3d forward = (to - from).normalized();
    const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
    axes << right.transpose(), right.cross(forward).transpose(), forward.transpose();
  }
  Vector3d ToEye(const Vector3d& p) const { return axes * (p - eye); }
  Vector3d ToWorld(const Vector3d& p) const { return axes.transpose() * p + eye; }
};

/// Rasterizes a screen triangle and calls `visit` with x, y and the linearly interpolated z of each sample.
template <class Shade>
void Fill(Buffer& buffer, const std::array<Vector3d, 3>& p, Shade visit) {
  const double area = (p[1] - p[0]).x() * (p[2] - p[0]).y() - (p[1] - p[0]).y() * (p[2] - p[0]).x();
  if (area == 0.0) return;
  const auto bound = [](double value, int limit) { return std::clamp(static_cast<int>(value), 0, limit); };
  const int x0 = bound(std::floor(std::min({p[0].x(), p[1].x(), p[2].x()})), buffer.width - 1);
  const int x1 = bound(std::ceil(std::max({p[0].x(), p[1].x(), p[2].x()})), buffer.width - 1);
  const int y0 = bound(std::floor(std::min({p[0].y(), p[1].y(), p[2].y()})), buffer.height - 1);
  const int y1 = bound(std::ceil(std::max({p[0].y(), p[1].y(), p[2].y()})), buffer.height - 1);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Vector2d s(x + 0.5, y + 0.5);
      std::array<double, 3> weight{};
      bool inside = true;
      for (size_t k = 0; k < 3 && inside; ++k) {
        const Vector3d& a = p[(k + 1) % 3];
        const Vector3d& b = p[(k + 2) % 3];
        weight[k] = ((b - a).x() * (s.y() - a.y()) - (b - a).y() * (s.x() - a.x())) / area;
        inside = weight[k] >= 0.0;
      }
      if (inside) visit(x, y, weight[0] * p[0].z() + weight[1] * p[1].z() + weight[2] * p[2].z());
    }
  }
}

/// Clips a polygon by a half space.
std::vector<Vector3d> Clip(const std::vector<Vector3d>& polygon, const Vector3d& normal, double offset) {
  std::vector<Vector3d> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d& p = polygon[i];
    const Vector3d& q = polygon[(i + 1) % polygon.size()];
    const double dp = normal.dot(p) + offset;
    const double dq = normal.dot(q) + offset;
    if (dp >= 0.0) kept.push_back(p);
    if ((dp >= 0.0) != (dq >= 0.0)) kept.emplace_back(p + (q - p) * (dp / (dp - dq)));
  }
  return kept;
}

class Renderer {
 public:
  Renderer(const Drawing& drawing, const Camera& camera)
      : drawing_(drawing),
        camera_(camera),
        image_(camera.width * kSamples, camera.height * kSamples),
        shadow_(camera.shadow_size, camera.shadow_size),
        view_(camera.eye, camera.target),
        sun_({0.0, 0.0, 0.0}, -SunDirection()) {
    for (const Vector3d& vertex : drawing.mesh.vertices) {
      if (vertex.z() <= camera.cut_m) sun_box_.extend(sun_.ToEye(vertex));
    }
    scale_ = 0.5 * image_.height / std::tan(0.5 * camera.field_of_view_rad);
  }

  Picture Draw() {
    for (size_t t = 0; t < drawing_.mesh.triangles.size(); ++t) DrawTriangle(static_cast<int>(t));
    return Resolve();
  }

 private:
  static Vector3d SunDirection() { return Vector3d(-0.45, -0.6, 1.1).normalized(); }

  void DrawTriangle(int t) {
    std::vector<Vector3d> polygon;
    for (const int corner : drawing_.mesh.triangles[static_cast<size_t>(t)]) {
      polygon.push_back(drawing_.mesh.vertices[static_cast<size_t>(corner)]);
    }
    polygon = Clip(polygon, -Vector3d::UnitZ(), camera_.cut_m);
    if (polygon.size() < 3) return;
    for (size_t k = 1; k + 1 < polygon.size(); ++k) {
      Fill(shadow_, {OnSun(polygon[0]), OnSun(polygon[k]), OnSun(polygon[k + 1])}, [&](int x, int y, double depth) {
        float& nearest = shadow_.depth[shadow_.At(x, y)];
        nearest = std::min(nearest, static_cast<float>(depth));
      });
    }
    constexpr double kNear = 0.1;
    const Vector3d forward = view_.axes.row(2).transpose();
    polygon = Clip(polygon, forward, -forward.dot(view_.eye) - kNear);
    for (size_t k = 1; k + 1 < polygon.size(); ++k) {
      Fill(image_, {OnScreen(polygon[0]), OnScreen(polygon[k]), OnScreen(polygon[k + 1])},
           [&](int x, int y, double inverse) {
             const size_t at = image_.At(x, y);
             const auto depth = static_cast<float>(1.0 / inverse);
             if (depth >= image_.depth[at]) return;
             image_.depth[at] = depth;
             image_.triangle[at] = t;
           });
    }
  }

  Vector3d OnScreen(const Vector3d& p) const {
    const Vector3d e = view_.ToEye(p);
    return {0.5 * image_.width + scale_ * e.x() / e.z(), 0.5 * image_.height - scale_ * e.y() / e.z(), 1.0 / e.z()};
  }
  Vector3d OnSun(const Vector3d& p) const {
    const Vector3d e = sun_.ToEye(p);
    const double scale = shadow_.width / std::max(sun_box_.sizes().x(), sun_box_.sizes().y());
    return {(e.x() - sun_box_.min().x()) * scale, (e.y() - sun_box_.min().y()) * scale, e.z()};
  }

  /// Returns 1 in the sun, less in the shadow; four samples soften the border.
  double Light(const Vector3d& p) const {
    constexpr double kBias = 0.04;
    const Vector3d s = OnSun(p);
    double lit = 0.0;
    for (const double dx : {-0.6, 0.6}) {
      for (const double dy : {-0.6, 0.6}) {
        const int x = std::clamp(static_cast<int>(s.x() + dx), 0, shadow_.width - 1);
        const int y = std::clamp(static_cast<int>(s.y() + dy), 0, shadow_.width - 1);
        lit += s.z() - kBias <= shadow_.depth[shadow_.At(x, y)] ? 0.25 : 0.0;
      }
    }
    return lit;
  }

  Vector3d Sample(int x, int y) const {
    const size_t at = image_.At(x, y);
    const int t = image_.triangle[at];
    const double up = static_cast<double>(y) / image_.height;
    if (t < 0) return Vector3d(205.0, 218.0, 232.0) + up * Vector3d(30.0, 22.0, 14.0);
    const auto& corners = drawing_.mesh.triangles[static_cast<size_t>(t)];
    const auto vertex = [&](size_t k) { return drawing_.mesh.vertices[static_cast<size_t>(corners[k])]; };
    Vector3d normal = (vertex(1) - vertex(0)).cross(vertex(2) - vertex(0)).normalized();
    const double depth = image_.depth[at];
    const Vector3d eye((x + 0.5 - 0.5 * image_.width) * depth / scale_,
                       (0.5 * image_.height - y - 0.5) * depth / scale_, depth);
    const Vector3d point = view_.ToWorld(eye);
    const bool inside = normal.dot(view_.eye - point) < 0.0;  // back face, visible inside a solid that the cut opened
    if (inside) normal = -normal;
    const double direct = std::max(0.0, normal.dot(SunDirection())) * Light(point + 0.02 * normal);
    const double brightness = (0.5 + 0.08 * normal.z() + 0.62 * direct) * (inside ? 0.6 : 1.0);
    const Colour& colour = drawing_.colours[static_cast<size_t>(t)];
    return brightness * Vector3d(colour[0], colour[1], colour[2]) * (Edge(x, y) ? 0.72 : 1.0);
  }

  bool Edge(int x, int y) const {
    const int t = image_.triangle[image_.At(x, y)];
    for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1)}) {
      if (x + dx >= image_.width || y + dy >= image_.height) continue;
      const int other = image_.triangle[image_.At(x + dx, y + dy)];
      if (other >= 0 && drawing_.parts[static_cast<size_t>(t)] != drawing_.parts[static_cast<size_t>(other)])
        return true;
    }
    return false;
  }

  Picture Resolve() const {
    Picture picture{camera_.width, camera_.height, {}};
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        Vector3d sum = Vector3d::Zero();
        for (int s = 0; s < kSamples * kSamples; ++s) {
          sum += Sample(x * kSamples + s % kSamples, y * kSamples + s / kSamples);
        }
        for (int c = 0; c < 3; ++c) {
          const double value = sum[c] / (kSamples * kSamples);
          picture.rgb.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
        }
      }
    }
    return picture;
  }

  const Drawing& drawing_;
  const Camera& camera_;
  Buffer image_;
  Buffer shadow_;
  View view_;
  View sun_;
  Eigen::AlignedBox3d sun_box_;
  double scale_ = 1.0;
};

}  // namespace

Picture Render(const Drawing& drawing, const Camera& camera) { return Renderer(drawing, camera).Draw(); }

Picture Beside(const Picture& left, const Picture& right) {
  Picture both{left.width + right.width, left.height, {}};
  for (int y = 0; y < left.height; ++y) {
    for (const Picture* part : {&left, &right}) {
      const std::ptrdiff_t row = std::ptrdiff_t{3} * part->width;
      both.rgb.insert(both.rgb.end(), part->rgb.begin() + row * y, part->rgb.begin() + row * (y + 1));
    }
  }
  return both;
}

void WritePng(const std::filesystem::path& path, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, path.c_str(), 0, picture.rgb.data(), 0, nullptr) == 0) {
    throw InputError({path.string(), "", "", std::string("cannot be written: ") + image.message,
                      "check the folder's permissions and free space"});
  }
}

}  // namespace legopt::worldgen
