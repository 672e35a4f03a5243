#include "legopt/worldgen/internal/posture_selection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "legopt/math/parallel.h"
#include "legopt/math/random_numbers.h"
#include "legopt/types/input_error.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

template <class Point>
std::vector<Point> Scaled(std::span<const Point> points) {
  Point mean = Point::Zero();
  Point square = Point::Zero();
  const auto n = static_cast<double>(points.size());
  for (const Point& p : points) mean += p / n;
  for (const Point& p : points) square += (p - mean).cwiseAbs2() / n;
  constexpr double kConstant = 1e-9;  // a constant coordinate is ignored
  const Point scale = square.cwiseSqrt().unaryExpr([](double s) { return s > kConstant ? 1.0 / s : 0.0; });
  std::vector<Point> scaled;
  for (const Point& p : points) scaled.emplace_back((p - mean).cwiseProduct(scale));
  return scaled;
}

/// Returns the index of the nearest centre; the first one on a tie.
template <class Point>
size_t Nearest(const std::vector<Point>& centres, const Point& p) {
  size_t best = 0;
  for (size_t c = 1; c < centres.size(); ++c) {
    if ((centres[c] - p).squaredNorm() < (centres[best] - p).squaredNorm()) best = c;
  }
  return best;
}

/// k-means++: every further centre is a random point with probability proportional to the squared distance from the
/// previous ones.
template <class Point>
std::vector<Point> StartCentres(const std::vector<Point>& points, int k, std::mt19937_64& generator) {
  std::vector<Point> centres = {
      points[static_cast<size_t>(UniformRandom(generator) * static_cast<double>(points.size()))]};
  while (std::ssize(centres) < k) {
    std::vector<double> sums;
    double sum = 0.0;
    for (const Point& p : points) {
      sum += (centres[Nearest(centres, p)] - p).squaredNorm();
      sums.push_back(sum);
    }
    const double target = UniformRandom(generator) * sum;
    const auto found = std::upper_bound(sums.begin(), sums.end(), target) - sums.begin();
    centres.push_back(points[static_cast<size_t>(std::min<std::ptrdiff_t>(found, std::ssize(points) - 1))]);
  }
  return centres;
}

template <class Point>
double Distance2(const std::vector<Point>& points, const std::vector<Point>& centres, const std::vector<size_t>& owner,
                 size_t i) {
  return (points[i] - centres[owner[i]]).squaredNorm();
}

/// Returns the index of the point farthest from its own centre.
template <class Point>
size_t Farthest(const std::vector<Point>& points, const std::vector<Point>& centres, const std::vector<size_t>& owner) {
  size_t worst = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    if (Distance2(points, centres, owner, i) > Distance2(points, centres, owner, worst)) worst = i;
  }
  return worst;
}

}  // namespace

StanceFeatures FeaturesOf(const Stance& stance, StanceProbe& probe) {
  StanceFeatures features;
  for (const ContactTarget& foothold : stance.contacts) {
    const Vector3d apart = foothold.position - stance.contacts.front().position;
    features.length_m = std::max(features.length_m, apart.head<2>().norm());
    features.height_m = std::max(features.height_m, std::abs(apart.z()));
    const double nz = (foothold.rotation.normalized() * Vector3d::UnitZ()).z();
    features.tilt_rad = std::max(features.tilt_rad, std::acos(std::clamp(nz, -1.0, 1.0)));
  }
  features.trunk_distance_m = probe.TrunkDistance(stance, StanceFeatures::kTrunkRange_m);
  return features;
}

namespace {

template <class Point>
std::vector<std::vector<int>> Clusters(std::span<const Point> points, int k, std::uint64_t seed) {
  if (k < 1 || k > std::ssize(points)) {
    throw InputError({"selection", "posture problems", std::to_string(k),
                      "cannot be chosen from " + std::to_string(points.size()) + " different stances",
                      "ask for fewer, or for more plans"});
  }
  std::mt19937_64 generator(seed);
  const std::vector<Point> scaled = Scaled<Point>(points);
  std::vector<Point> centres = StartCentres(scaled, k, generator);
  std::vector<size_t> owner(scaled.size(), std::numeric_limits<size_t>::max());
  constexpr int kMaxRounds = 200;
  constexpr double kSamePlace2 = 1e-18;  // squared rounding error between a point and the mean of its copies
  for (int round = 0; round < kMaxRounds; ++round) {
    bool changed = false;
    std::vector<Point> sums(centres.size(), Point::Zero());
    std::vector<int> counts(centres.size(), 0);
    for (size_t i = 0; i < scaled.size(); ++i) {
      const size_t nearest = Nearest(centres, scaled[i]);
      changed = changed || nearest != owner[i];
      owner[i] = nearest;
      sums[nearest] += scaled[i];
      ++counts[nearest];
    }
    for (size_t c = 0; c < centres.size(); ++c) {
      // A centre without points restarts at the point that is farthest from its centre.
      const size_t farthest = counts[c] > 0 ? 0 : Farthest(scaled, centres, owner);
      if (counts[c] == 0 && Distance2(scaled, centres, owner, farthest) > kSamePlace2) {
        centres[c] = scaled[farthest];
        owner[farthest] = c;
        changed = true;
      }
    }
    if (!changed) break;
    for (size_t c = 0; c < centres.size(); ++c) {
      if (counts[c] > 0) centres[c] = sums[c] / counts[c];
    }
  }
  std::vector<std::vector<int>> clusters(centres.size());
  for (size_t i = 0; i < scaled.size(); ++i) clusters[owner[i]].push_back(static_cast<int>(i));
  std::erase_if(clusters, [](const auto& cluster) { return cluster.empty(); });
  std::sort(clusters.begin(), clusters.end(), [](const auto& a, const auto& b) { return a.front() < b.front(); });
  for (std::vector<int>& cluster : clusters) {
    const Point centre = centres[owner[static_cast<size_t>(cluster.front())]];
    const auto distance = [&](int i) { return (scaled[static_cast<size_t>(i)] - centre).squaredNorm(); };
    std::stable_sort(cluster.begin(), cluster.end(), [&](int a, int b) { return distance(a) < distance(b); });
  }
  return clusters;
}

}  // namespace

std::vector<std::vector<int>> ClusterPoints(std::span<const Vector3d> points, int k, std::uint64_t seed) {
  return Clusters(points, k, seed);
}

std::vector<std::vector<int>> ClusterPoints(std::span<const Vector6d> points, int k, std::uint64_t seed) {
  return Clusters(points, k, seed);
}

namespace {

constexpr int kNone = -1;

/// Returns for each cluster the first member that `prove` accepts, or kNone.
std::vector<int> ProveClusters(const std::vector<std::vector<int>>& clusters, int threads, const ProveMember& prove) {
  std::vector<int> chosen(clusters.size(), kNone);
  ForEachIndex(threads, clusters.size(), [&](int worker, std::size_t c) {
    const auto proven =
        std::find_if(clusters[c].begin(), clusters[c].end(), [&](int member) { return prove(worker, c, member); });
    if (proven != clusters[c].end()) chosen[c] = *proven;
  });
  return chosen;
}

}  // namespace

std::vector<int> SelectProven(std::span<const Eigen::Vector3d> points, int count, std::uint64_t seed, int threads,
                              const ProveMember& prove, const std::function<void(int, int)>& progress) {
  std::vector<int> candidates(points.size());  // indices into `points`
  for (std::size_t i = 0; i < points.size(); ++i) candidates[i] = static_cast<int>(i);
  while (std::ssize(candidates) >= count) {
    std::vector<Eigen::Vector3d> places;
    for (const int candidate : candidates) places.push_back(points[static_cast<std::size_t>(candidate)]);
    std::vector<std::vector<int>> clusters = ClusterPoints(std::span<const Eigen::Vector3d>(places), count, seed);
    if (std::ssize(clusters) < count) break;  // too few different points
    for (std::vector<int>& cluster : clusters) {
      for (int& member : cluster) member = candidates[static_cast<std::size_t>(member)];
    }
    const std::vector<int> chosen = ProveClusters(clusters, threads, prove);
    const auto proven = count - static_cast<int>(std::count(chosen.begin(), chosen.end(), kNone));
    if (progress) progress(proven, count);
    if (proven == count) return chosen;
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      if (chosen[c] != kNone) continue;
      std::erase_if(candidates, [&](int candidate) {
        return std::find(clusters[c].begin(), clusters[c].end(), candidate) != clusters[c].end();
      });
    }
  }
  throw InputError({"selection", "posture problems", std::to_string(candidates.size()),
                    "the plans have only so many different stances whose neighbourhood has postures",
                    "ask for fewer posture problems, or for more plans"});
}

}  // namespace legopt::worldgen
