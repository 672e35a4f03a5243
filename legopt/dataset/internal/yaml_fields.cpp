#include "legopt/dataset/internal/yaml_fields.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {

std::string DescribeNode(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsScalar()) return node.Scalar();
  return node.IsMap() ? "a map" : "a list";
}

std::optional<double> AsNumber(const YAML::Node& node) {
  if (!node.IsDefined() || !node.IsScalar()) return std::nullopt;
  const std::optional<double> value = ParseNumber(node.Scalar());
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<Eigen::Vector3d> AsVector3(const YAML::Node& node) {
  if (!node.IsDefined() || !node.IsSequence() || node.size() != 3) return std::nullopt;
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) {
    const std::optional<double> value = AsNumber(node[static_cast<size_t>(i)]);
    if (!value) return std::nullopt;
    vector[i] = *value;
  }
  return vector;
}

YamlFields::YamlFields(const YAML::Node& map, std::string file, std::string place,
                       const std::vector<std::string>& known)
    : map_(map), file_(std::move(file)), place_(std::move(place)) {
  if (!map_.IsMap()) Fail("", DescribeNode(map_), "must be a map of keys and values", "write 'key: value' lines");
  for (const auto& entry : map_) {
    const std::string key = DescribeNode(entry.first);
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      Fail(key, "", "unknown key", SuggestName(key, known));
    }
  }
}

YAML::Node YamlFields::Get(const std::string& key) const {
  for (const auto& entry : map_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

YAML::Node YamlFields::Require(const std::string& key) const {
  YAML::Node node = Get(key);
  if (!node.IsDefined() || node.IsNull()) Fail(key, "", "the key is missing", "add '" + key + ": ...'");
  return node;
}

std::optional<std::string> YamlFields::Text(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  if (!node.IsScalar() || node.Scalar().empty()) Fail(key, DescribeNode(node), "must be a text", "write one word");
  return node.Scalar();
}

std::optional<double> YamlFields::Number(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  const std::optional<double> value = AsNumber(node);
  if (!value) Fail(key, DescribeNode(node), "must be a finite number", "write a number in SI units");
  return value;
}

std::optional<Eigen::Vector3d> YamlFields::Vector3(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  const std::optional<Eigen::Vector3d> vector = AsVector3(node);
  if (!vector) Fail(key, DescribeNode(node), "must be three finite numbers", "write [x, y, z]");
  return vector;
}

std::string YamlFields::RequireText(const std::string& key) const {
  Require(key);
  return *Text(key);
}

double YamlFields::RequireNumber(const std::string& key) const {
  Require(key);
  return *Number(key);
}

std::string YamlFields::Path(const std::string& key) const {
  if (key.empty()) return place_;
  return place_.empty() ? key : place_ + "." + key;
}

void YamlFields::Fail(const std::string& key, const std::string& value, const std::string& message,
                      const std::string& fix) const {
  throw InputError({.file = file_, .field = Path(key), .value = value, .message = message, .fix = fix});
}

namespace {

constexpr std::size_t kMostPoints = 64;
constexpr double kMostFriction = 2.0;
constexpr double kLargestRadius_m = 1.0;

ContactKind ReadKind(const YamlFields& fields) {
  const std::string text = fields.RequireText("kind");
  std::vector<std::string> names, implemented;
  for (const ContactKindDescription& row : kContactKinds) {
    names.emplace_back(ToString(row.kind));
    if (row.implemented) implemented.push_back(names.back());
  }
  const std::optional<ContactKind> kind = ParseEnum<ContactKind>(text);
  if (!kind) fields.Fail("kind", text, "is no kind of contact", SuggestName(text, names));
  if (!DescriptionOf(*kind).implemented) {
    std::string supported;
    for (const std::string& name : implemented) supported += (supported.empty() ? "" : ", ") + name;
    fields.Fail("kind", text, "is not supported yet", "supported: " + supported);
  }
  return *kind;
}

void ReadFrame(const YamlFields& fields, ContactDescription* contact) {
  const YAML::Node node = fields.Get("frame");
  if (!node.IsDefined() || node.IsNull()) return;
  const YamlFields frame(node, fields.file(), fields.Path("frame"), {"position", "rpy"});
  contact->position = frame.Vector3("position").value_or(contact->position);
  contact->rpy_rad = frame.Vector3("rpy").value_or(contact->rpy_rad);
}

void ReadPoints(const YamlFields& fields, ContactDescription* contact) {
  const YAML::Node list = fields.Get("points");
  const auto least = static_cast<std::size_t>(DescriptionOf(contact->kind).least_points);
  if (!list.IsDefined() || list.IsNull()) return;
  if (contact->kind == ContactKind::kPoint) {
    fields.Fail("points", DescribeNode(list), "are those of a patch, but a contact of kind 'point' has none",
                "give the centre of its ball as position of the frame, and radius_m");
  }
  if (!list.IsSequence() || list.size() < least || list.size() > kMostPoints) {
    fields.Fail("points", DescribeNode(list),
                "must be a list of " + std::to_string(least) + " to " + std::to_string(kMostPoints) + " points",
                "write points: [[0.1, 0.05, 0], [0.1, -0.05, 0], [-0.1, -0.05, 0], [-0.1, 0.05, 0]]");
  }
  std::vector<Eigen::Vector3d>& points = contact->points.emplace();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string key = "points[" + std::to_string(i) + "]";
    const std::optional<Eigen::Vector3d> point = AsVector3(list[i]);
    if (!point) fields.Fail(key, DescribeNode(list[i]), "must be three finite numbers", "write [x, y, z] in metres");
    if (point->z() < 0.0) {
      fields.Fail(key, FormatFixed(point->z(), 6), "lies below the surface: z must not be negative",
                  "z is the point's height above the surface when the contact is at its target");
    }
    points.push_back(*point);
  }
}

void ReadRadius(const YamlFields& fields, ContactDescription* contact) {
  const std::optional<double> radius_m = fields.Number("radius_m");
  if (!radius_m) return;
  if (contact->kind != ContactKind::kPoint) {
    fields.Fail("radius_m", FormatFixed(*radius_m, 6), "is for contacts of kind 'point'", "remove it");
  }
  if (!(*radius_m >= 0.0 && *radius_m <= kLargestRadius_m)) {
    fields.Fail("radius_m", FormatFixed(*radius_m, 6), "must lie in [0, 1]",
                "give the radius of the foot's ball in metres");
  }
  contact->radius_m = *radius_m;
}

void ReadForces(const YamlFields& fields, ContactDescription* contact) {
  contact->friction = fields.Number("friction").value_or(contact->friction);
  if (!(contact->friction > 0.0 && contact->friction <= kMostFriction)) {
    fields.Fail("friction", FormatFixed(contact->friction, 6), "must lie in (0, 2]", "typical values: 0.4 to 0.8");
  }
  contact->max_normal_N = fields.Number("max_normal_N");
  if (contact->max_normal_N && !(*contact->max_normal_N > 0.0)) {
    fields.Fail("max_normal_N", FormatFixed(*contact->max_normal_N, 6), "must be greater than 0",
                "leave it out for no bound");
  }
}

ContactDescription ReadContact(const std::string& name, const YamlFields& fields) {
  ContactDescription contact;
  contact.name = name;
  contact.link = fields.RequireText("link");
  contact.kind = ReadKind(fields);
  ReadFrame(fields, &contact);
  ReadPoints(fields, &contact);
  ReadRadius(fields, &contact);
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
    contacts.push_back(
        ReadContact(name, YamlFields(entry.second, fields.file(), key,
                                     {"link", "kind", "frame", "points", "radius_m", "friction", "max_normal_N"})));
  }
  return contacts;
}

std::vector<ContactDescription> ReadSoles(const YamlFields& fields) {
  const std::vector<std::string> feet = ReadFeet(fields);
  const double offset_m = fields.RequireNumber("sole_offset_m");
  if (offset_m < 0) {
    fields.Fail("sole_offset_m", FormatFixed(offset_m, 6), "must not be negative",
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
    if (contact.kind == ContactKind::kPoint) list.back()["radius_m"] = contact.radius_m;
  }
  return list;
}

}  // namespace legopt
