#include "legopt/dataset/internal/contact_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr std::size_t kMostPoints = 64;
constexpr double kLargestLength_m = 1.0;

/// Keys of every contact, and those of a kind.
std::vector<std::string> KeysOf(const ContactKindDescription& facts) {
  std::vector<std::string> keys = {"link", "kind", "frame"};
  const auto add = [&](bool used, const char* key) {
    if (used) keys.emplace_back(key);
  };
  add(facts.shape != ContactShape::kBall, "points");
  add(HasRadius(facts.shape), "radius_m");
  add(facts.forces == ContactForces::kFrictionCones, "friction");
  add(facts.forces == ContactForces::kFrictionCones, "max_normal_N");
  add(facts.forces == ContactForces::kBounded, "max_force_N");
  add(facts.slides, "slide_m");
  return keys;
}

std::vector<std::string> AllKeys() {
  std::vector<std::string> keys;
  for (const ContactKindDescription& facts : kContactKinds) {
    for (const std::string& key : KeysOf(facts)) {
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  return keys;
}

ContactKind ReadKind(const YamlFields& fields) {
  const std::string text = fields.RequireText("kind");
  const std::optional<ContactKind> kind = ParseEnum<ContactKind>(text);
  if (kind) return *kind;
  std::vector<std::string> names;
  for (const ContactKindDescription& row : kContactKinds) names.emplace_back(ToString(row.kind));
  fields.Fail("kind", text, "is no kind of contact", SuggestName(text, names));
}

/// Refuses keys that other kinds have.
void CheckKeys(const YamlFields& fields, const ContactKindDescription& facts) {
  const std::vector<std::string> valid = KeysOf(facts);
  for (const std::string& key : AllKeys()) {
    if (!fields.Get(key).IsDefined() || std::ranges::find(valid, key) != valid.end()) continue;
    std::string others;
    for (const ContactKindDescription& other : kContactKinds) {
      const std::vector<std::string> keys = KeysOf(other);
      if (std::ranges::find(keys, key) == keys.end()) continue;
      others += (others.empty() ? "'" : " or '") + std::string(ToString(other.kind)) + "'";
    }
    fields.Fail(key, DescribeNode(fields.Get(key)), "is for contacts of kind " + others, "remove it");
  }
}

void ReadFrame(const YamlFields& fields, ContactDescription* contact) {
  const YAML::Node node = fields.Get("frame");
  if (!node.IsDefined() || node.IsNull()) return;
  const YamlFields frame(node, fields.file(), fields.Path("frame"), {"position", "rpy"});
  contact->position = frame.Vector3("position").value_or(contact->position);
  contact->rpy_rad = frame.Vector3("rpy").value_or(contact->rpy_rad);
}

std::string PointText(const Eigen::Vector3d& point) {
  return "[" + FormatNumber(point.x()) + ", " + FormatNumber(point.y()) + ", " + FormatNumber(point.z()) + "]";
}

Eigen::Vector3d ReadPoint(const YamlFields& fields, const YAML::Node& node, const std::string& key,
                          const ContactKindDescription& facts) {
  const std::optional<Eigen::Vector3d> point = AsVector3(node);
  if (!point) fields.Fail(key, DescribeNode(node), "must be three finite numbers", "write [x, y, z] in metres");
  if (HasPointsOnAxis(facts.shape) && (point->y() != 0.0 || point->z() != 0.0)) {
    fields.Fail(key, PointText(*point), "lies beside the x axis, about which the link may turn: y and z must be 0",
                "move the frame to this axis and write [x, 0, 0]");
  }
  if (point->z() < 0.0) {
    fields.Fail(key, PointText(*point), "lies below the surface: z must not be negative",
                "z is the point's height above the surface when the contact is at its target");
  }
  return *point;
}

/// Formats the edge of a patch from corner `i` to the next one.
std::string EdgeText(const std::vector<Eigen::Vector3d>& points, std::size_t i) {
  return PointText(points[i]) + " to " + PointText(points[(i + 1) % points.size()]);
}

double Turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d u = b - a, v = c - a;
  return u.x() * v.y() - u.y() * v.x();
}

/// Returns true if the segments ab and cd cross inside of both.
bool Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, const Eigen::Vector2d& d) {
  return Turn(a, b, c) * Turn(a, b, d) < 0.0 && Turn(c, d, a) * Turn(c, d, b) < 0.0;
}

/// Refuses patches whose edges cross, which are lists in a wrong order or with a wrong sign.
void CheckEdges(const YamlFields& fields, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector2d> corners;
  for (const Eigen::Vector3d& point : points) corners.emplace_back(point.head<2>());
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!Cross(corners[i], corners[(i + 1) % n], corners[j], corners[(j + 1) % n])) continue;
      fields.Fail("points", EdgeText(points, j) + " and " + EdgeText(points, i),
                  "the edges from points[" + std::to_string(j) + "] and points[" + std::to_string(i) + "] cross",
                  "list the corners in their order around the patch");
    }
  }
}

/// Refuses equal points, and patches without an area or with crossing edges.
void CheckPatch(const YamlFields& fields, const std::vector<Eigen::Vector3d>& points,
                const ContactKindDescription& facts) {
  constexpr double kEqual_m = 1e-6;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if ((points[i] - points[j]).norm() > kEqual_m) continue;
      fields.Fail("points[" + std::to_string(i) + "]", PointText(points[i]),
                  "is the same point as points[" + std::to_string(j) + "]", "remove one of them");
    }
  }
  if (facts.shape != ContactShape::kPatch) return;
  std::vector<Eigen::Vector2d> corners;
  for (const Eigen::Vector3d& point : points) corners.emplace_back(point.head<2>());
  constexpr double kLeastArea_m2 = 1e-8;
  if (PolygonArea(ConvexHull2d(corners)) < kLeastArea_m2) {
    fields.Fail("points", EdgeText(points, 0) + " ...", "lie on one line: a patch needs an area",
                "use kind 'point', or add a corner");
  }
  CheckEdges(fields, points);
}

void ReadPoints(const YamlFields& fields, ContactDescription* contact) {
  const ContactKindDescription& facts = DescriptionOf(contact->kind);
  const YAML::Node list = facts.supports ? fields.Get("points") : fields.Require("points");
  const auto least = static_cast<std::size_t>(facts.least_points);
  if (!list.IsDefined() || list.IsNull()) return;
  if (!list.IsSequence() || list.size() < least || list.size() > kMostPoints) {
    fields.Fail("points", DescribeNode(list),
                "must be a list of " + std::to_string(least) + " to " + std::to_string(kMostPoints) + " points",
                HasPointsOnAxis(facts.shape)
                    ? "write points: [[0.03, 0, 0], [-0.03, 0, 0]]"
                    : "write points: [[0.1, 0.05, 0], [0.1, -0.05, 0], [-0.1, -0.05, 0], [-0.1, 0.05, 0]]");
  }
  std::vector<Eigen::Vector3d>& points = contact->points.emplace();
  for (std::size_t i = 0; i < list.size(); ++i) {
    points.push_back(ReadPoint(fields, list[i], "points[" + std::to_string(i) + "]", facts));
  }
  CheckPatch(fields, points, facts);
}

/// Reads a length from 0 to 1 m, or leaves the default.
void ReadLength(const YamlFields& fields, const char* key, const char* fix, double* length_m) {
  *length_m = fields.Number(key).value_or(*length_m);
  if (*length_m >= 0.0 && *length_m <= kLargestLength_m) return;
  fields.Fail(key, FormatNumber(*length_m), "must lie in [0, 1]", fix);
}

/// Reads a force > 0.
std::optional<double> ReadForce(const YamlFields& fields, const char* key, const char* fix) {
  const std::optional<double> force_N = fields.Number(key);
  if (force_N && !(*force_N > 0.0)) fields.Fail(key, FormatNumber(*force_N), "must be greater than 0", fix);
  return force_N;
}

void ReadForces(const YamlFields& fields, ContactDescription* contact) {
  if (DescriptionOf(contact->kind).forces == ContactForces::kBounded) {
    fields.Require("max_force_N");
    contact->max_force_N = *ReadForce(fields, "max_force_N", "write the force that the hand can hold, in newtons");
    return;
  }
  contact->friction = fields.Number("friction").value_or(contact->friction);
  if (!IsFriction(contact->friction)) {
    fields.Fail("friction", FormatNumber(contact->friction), "must lie in (0, 2]", "typical values: 0.4 to 0.8");
  }
  contact->max_normal_N = ReadForce(fields, "max_normal_N", "leave it out for no bound");
}

ContactDescription ReadContact(const std::string& name, const YamlFields& fields) {
  ContactDescription contact;
  contact.name = name;
  contact.link = fields.RequireText("link");
  contact.kind = ReadKind(fields);
  CheckKeys(fields, DescriptionOf(contact.kind));
  ReadFrame(fields, &contact);
  ReadPoints(fields, &contact);
  ReadLength(fields, "radius_m", "give the radius of the foot's ball or of the bar in metres", &contact.radius_m);
  ReadLength(fields, "slide_m", "give the distance that the grip may be from its target along the bar, in metres",
             &contact.slide_m);
  ReadForces(fields, &contact);
  return contact;
}

std::vector<std::string> ReadFeet(const YamlFields& fields) {
  const YAML::Node list = fields.Require("feet");
  if (!list.IsSequence() || list.size() == 0) {
    fields.Fail("feet", DescribeNode(list), "must list at least one link", "write feet: [l_foot, r_foot]");
  }
  std::vector<std::string> feet;
  for (const YAML::Node& node : list) {
    if (!node.IsScalar()) fields.Fail("feet", DescribeNode(node), "must be link names", "write feet: [l_foot, r_foot]");
    if (std::find(feet.begin(), feet.end(), node.Scalar()) != feet.end()) {
      fields.Fail("feet", node.Scalar(), "the link is listed twice", "list every foot once");
    }
    feet.push_back(node.Scalar());
  }
  return feet;
}

nlohmann::json VectorJson(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

}  // namespace

std::vector<ContactDescription> ReadContacts(const YamlFields& fields) {
  const YAML::Node map = fields.Require("contacts");
  if (!map.IsMap() || map.size() == 0) {
    fields.Fail("contacts", DescribeNode(map), "must declare at least one contact",
                "write 'l_foot: {link: l_foot, kind: sole, frame: {position: [0, 0, -0.08]}}'");
  }
  std::vector<ContactDescription> contacts;
  std::set<std::string> names;
  for (const auto& entry : map) {
    const std::string name = DescribeNode(entry.first), key = "contacts." + name;
    RequireName(name, fields.file(), key);
    if (name.find_first_of(", ") != std::string::npos) {
      fields.Fail(key, name, "must contain neither comma nor blank, which separate contacts in a stance",
                  "use '_' or '-'");
    }
    if (!names.insert(name).second) fields.Fail(key, "", "is declared twice", "rename or remove one");
    contacts.push_back(ReadContact(name, YamlFields(entry.second, fields.file(), key, AllKeys())));
  }
  return contacts;
}

std::vector<ContactDescription> ReadSoles(const YamlFields& fields) {
  const std::vector<std::string> feet = ReadFeet(fields);
  const double offset_m = fields.RequireNumber("sole_offset_m");
  if (offset_m < 0) {
    fields.Fail("sole_offset_m", FormatNumber(offset_m), "must not be negative",
                "write the height of the foot's link frame above its sole target");
  }
  return DescribeSoles(feet, offset_m);
}

nlohmann::json CanonicalContacts(const std::vector<ContactDescription>& contacts) {
  nlohmann::json list = nlohmann::json::array();
  for (const ContactDescription& contact : contacts) {
    nlohmann::json points;
    if (contact.points) {
      points = nlohmann::json::array();
      for (const Eigen::Vector3d& point : *contact.points) points.push_back(VectorJson(point));
    }
    list.push_back({{"name", contact.name},
                    {"link", contact.link},
                    {"kind", ToString(contact.kind)},
                    {"position", VectorJson(contact.position)},
                    {"rpy", VectorJson(contact.rpy_rad)},
                    {"points", points},
                    {"friction", contact.friction},
                    {"max_normal_N", contact.max_normal_N ? nlohmann::json(*contact.max_normal_N) : nlohmann::json()}});
    const ContactKindDescription& facts = DescriptionOf(contact.kind);
    if (HasRadius(facts.shape)) list.back()["radius_m"] = contact.radius_m;
    if (facts.forces == ContactForces::kBounded) list.back()["max_force_N"] = contact.max_force_N;
    if (facts.slides) list.back()["slide_m"] = contact.slide_m;
  }
  return list;
}

}  // namespace legopt
