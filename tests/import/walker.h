// Robots with legs for imports.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace legopt::test {

inline constexpr const char* kSole = "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry>";
inline constexpr const char* kBall = "<origin xyz='0 0 -0.02'/><geometry><sphere radius='0.02'/></geometry>";

inline std::string Link(const std::string& name, double mass_kg, double com_y_m, const std::string& collision) {
  return "<link name='" + name + "'><inertial><origin xyz='0 " + std::to_string(com_y_m) + " 0'/><mass value='" +
         std::to_string(mass_kg) + "'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial>" +
         (collision.empty() ? "" : "<collision>" + collision + "</collision>") + "</link>";
}

inline std::string Joint(const std::string& name, const std::string& parent, const std::string& child,
                         const std::string& place, const std::string& axis, const std::string& limits) {
  return "<joint name='" + name + "' type='revolute'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin xyz='" + place + "'/><axis xyz='" + axis + "'/><limit " + limits +
         " effort='100' velocity='10'/></joint>";
}

/// A trunk on legs with hip roll, hip pitch, knee and ankle (only with soles); legs at x, y.
struct Walker {
  std::vector<std::pair<std::string, std::string>> legs = {{"l", "0 0.1"}, {"r", "0 -0.1"}};
  std::string foot = kSole;
  std::string ankle_limits = "lower='-1' upper='1'";
  double thigh_ball_m = 0.0;  ///< radius of a ball 0.06 m inwards of the hip; 0: none
  std::string more = "";      ///< elements at the end
  double trunk_com_y_m = 0.0;

  std::string Thigh(const std::string& leg) const {
    if (thigh_ball_m == 0.0) return "";
    return "<origin xyz='0 " + std::string(leg == "l" ? "-0.06" : "0.06") + " 0'/><geometry><sphere radius='" +
           std::to_string(thigh_ball_m) + "'/></geometry>";
  }

  std::string Urdf() const {
    std::string text =
        "<robot name='walker'>" +
        Link("trunk", 10.0, trunk_com_y_m, "<origin xyz='0 0 0.2'/><geometry><box size='0.2 0.1 0.2'/></geometry>");
    for (const auto& [name, place] : legs) {
      text += Link(name + "_hip", 0.5, 0.0, "") + Link(name + "_thigh", 1.0, 0.0, Thigh(name)) +
              Link(name + "_shank", 1.0, 0.0, "") + Link(name + "_foot", 0.5, 0.0, foot);
      text += Joint(name + "_roll", "trunk", name + "_hip", place + " 0", "1 0 0", "lower='-0.5' upper='0.5'");
      text += Joint(name + "_pitch", name + "_hip", name + "_thigh", "0 0 0", "0 1 0", "lower='-1.5' upper='1.5'");
      text += Joint(name + "_knee", name + "_thigh", name + "_shank", "0 0 -0.3", "0 1 0", "lower='0' upper='2.5'");
      text += Joint(name + "_ankle", name + "_shank", name + "_foot", "0 0 -0.3", "0 1 0", ankle_limits);
    }
    return text + more + "</robot>";
  }
};

}  // namespace legopt::test
