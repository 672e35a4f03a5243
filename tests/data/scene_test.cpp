// Policy: the embedded scene is statically plausible. Every piece is supported from below, and pieces touch without
// penetrating each other. A car's body hangs between its wheels, so sideways contact is sufficient for it.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/data/embedded_dataset.h"

namespace legopt {
namespace {

// A supported piece, lowered by this much, penetrates its support by nearly this much; a floating piece does not.
// Penetration has a well-defined normal, exact touching does not.
constexpr double kLowered_m = 1e-3;
constexpr double kMaxSinking_m = 1e-3;
constexpr double kGap_m = 1e-3;

struct Touch {
  bool from_below = false;
  bool any = false;
  double deepest_m = 0;
};

Touch TouchOf(size_t index, const Scene& scene) {
  Scene others;
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    if (i != index) others.objects.push_back(scene.objects[i]);
  }
  Probe probe(scene.objects[index].shape, others);
  Touch touch;
  for (const ProximityPair& contact : probe.Contacts(Eigen::Isometry3d::Identity(), kGap_m)) {
    touch.any = true;
    touch.deepest_m = std::max(touch.deepest_m, -contact.distance_m);
  }
  const Eigen::Isometry3d lowered(Eigen::Translation3d(0, 0, -kLowered_m));
  for (const ProximityPair& contact : probe.Contacts(lowered, 0.0)) {
    if (contact.normal_W.z() > 0.5) touch.from_below = true;
  }
  return touch;
}

TEST(EmbeddedScene, HasTheParts) {
  const Scene& scene = EmbeddedDataset()->scene();
  const auto count = [&](const std::string& prefix) {
    return std::count_if(scene.objects.begin(), scene.objects.end(),
                         [&](const SceneObject& object) { return object.name.starts_with(prefix); });
  };
  EXPECT_EQ(count("ground"), 1);
  EXPECT_GE(count("slab-"), 3);
  EXPECT_GE(count("column-"), 6);
  EXPECT_GE(count("ramp-"), 2);
  EXPECT_GE(count("step-"), 5);
  EXPECT_EQ(count("car-"), 3 * 6);
  EXPECT_GE(count("plate-"), 5);
}

TEST(EmbeddedScene, EveryPieceIsCarriedAndNoneSinksIn) {
  const Scene& scene = EmbeddedDataset()->scene();
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const std::string& name = scene.objects[i].name;
    const Touch touch = TouchOf(i, scene);
    EXPECT_LE(touch.deepest_m, kMaxSinking_m) << name << " sinks into another piece";
    if (name == "ground") continue;
    const bool hangs = name.starts_with("car-") && name.ends_with("-body");
    EXPECT_TRUE(hangs ? touch.any : touch.from_below) << name << " floats";
  }
}

}  // namespace
}  // namespace legopt
