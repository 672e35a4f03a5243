#include "legopt/planning/internal/numeric_fingerprint.h"

#include <dlfcn.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <string_view>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/trimesh_world.h"
#include "legopt/math/blake2b.h"

namespace legopt {
namespace {

constexpr int kSamples = 48;

/// Numbers in [0, 1), the same on every machine. Volatile, so that a compiler cannot precompute them.
class FixedNumbers {
 public:
  double Next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    constexpr double kUnit = 0x1p-53;
    return static_cast<double>(state_ >> 11U) * kUnit;
  }

 private:
  volatile std::uint64_t state_ = 88172645463325252ULL;
};

class Sum {
 public:
  void Add(double value) { bytes_.append(std::string_view(reinterpret_cast<const char*>(&value), sizeof value)); }
  std::string Text() const {
    constexpr std::size_t kBytes = 16, kDigits = 16;
    return Blake2bHex(bytes_, kBytes).substr(0, kDigits);
  }

 private:
  std::string bytes_;
};

void AddElementaryFunctions(FixedNumbers& numbers, Sum& sum) {
  for (int i = 0; i < kSamples; ++i) {
    const double x = numbers.Next(), y = numbers.Next();
    const double angle = 8.0 * x - 4.0, size = 0.01 + 40.0 * y;
    double sine = 0.0, cosine = 0.0;
    sincos(angle, &sine, &cosine);
    for (const double value :
         {std::sin(angle), std::cos(angle), std::tan(angle), std::asin(x), std::acos(x), std::atan(size), sine, cosine,
          std::atan2(angle, size), std::tanh(angle), std::exp(-size), std::log(size), std::log10(size),
          std::log1p(-x * y), std::pow(size, angle), std::hypot(angle, size)}) {
      sum.Add(value);
    }
    for (const float value : {std::sin(static_cast<float>(angle)), std::acos(static_cast<float>(x)),
                              std::pow(static_cast<float>(size), static_cast<float>(angle))}) {
      sum.Add(value);
    }
  }
}

TriangleMesh Tetrahedron(FixedNumbers& numbers) {
  TriangleMesh mesh;
  for (int i = 0; i < 4; ++i) {
    // Corners of a cube that are not adjacent, each moved a little.
    const Eigen::Vector3d corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, (i == 1 || i == 2) ? 0.5 : -0.5);
    mesh.vertices.push_back(corner + 0.2 * Eigen::Vector3d(numbers.Next(), numbers.Next(), numbers.Next()));
  }
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

void AddContacts(FixedNumbers& numbers, Sum& sum) {
  TrimeshWorld world;
  const int a = world.Add(Tetrahedron(numbers)), b = world.Add(Tetrahedron(numbers));
  for (int i = 0; i < kSamples / 4; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    const Eigen::Vector4d turn(numbers.Next(), numbers.Next(), numbers.Next(), 0.5 + numbers.Next());
    pose.linear() = Eigen::Quaterniond(turn).normalized().toRotationMatrix();
    pose.translation() << 0.6 * numbers.Next(), 0.6 * numbers.Next(), 0.6 * numbers.Next();
    world.SetPose(b, pose);
    sum.Add(world.Depth(a, b));
  }
}

/// Returns a function of the Fortran libraries, or null if no library of the process has it.
template <class Function>
Function* Loaded(const char* name) {
  void* const symbol = dlsym(RTLD_DEFAULT, name);
  Function* function = nullptr;
  std::memcpy(&function, &symbol, sizeof symbol);
  return function;
}

using Product = double(const int*, const double*, const int*, const double*, const int*);
using Factors = void(const char*, const int*, double*, const int*, int*);

/// Adds Ipopt's linear algebra: a scalar product, and the Cholesky factors of a matrix that is large enough to be
/// processed in blocks.
void AddLinearAlgebra(FixedNumbers& numbers, Sum& sum) {
  constexpr int kSize = 150, kOne = 1;
  const Eigen::MatrixXd random = Eigen::MatrixXd::NullaryExpr(kSize, kSize, [&] { return numbers.Next(); });
  if (const auto product = Loaded<Product>("ddot_")) {
    sum.Add(product(&kSize, random.data(), &kOne, random.data() + kSize, &kOne));
  }
  if (const auto factorize = Loaded<Factors>("dpotrf_")) {
    Eigen::MatrixXd matrix = 0.01 * (random + random.transpose());
    matrix.diagonal().array() += 4.0;
    int info = 0;
    factorize("L", &kSize, matrix.data(), &kSize, &info);
    for (int i = 0; i < kSize; ++i) sum.Add(matrix(kSize - 1, i));
  }
}

}  // namespace

std::string NumericFingerprint() {
  FixedNumbers numbers;
  Sum sum;
  AddElementaryFunctions(numbers, sum);
  AddContacts(numbers, sum);
  AddLinearAlgebra(numbers, sum);
  return sum.Text();
}

}  // namespace legopt
