#include "legopt/robot/internal/urdf_check.h"

#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "legopt/input/text.h"
#include "legopt/robot/internal/urdf_reader.h"
#include "legopt/robot/internal/urdf_rules.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

constexpr std::size_t kMostLinks = 2000;
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

/// Returns the location for errors, "link 'pelvis'". Elements with a name start a new location; others extend `outer`.
std::string PlaceOf(const XMLElement& element, const std::string& outer) {
  const char* name = element.Attribute("name");
  const std::string_view kind = element.Name();
  const bool titled = kind == "link" || kind == "joint" || (kind == "material" && outer == "robot");
  const std::string own = std::string(kind) + (titled && name != nullptr ? " '" + PrintableUrdfText(name) + "'" : "");
  return titled || outer.empty() ? own : outer + ": " + own;
}

/// Checks a document against the rules and copies the elements and attributes that are read into another document.
class UrdfWalk {
 public:
  explicit UrdfWalk(const std::string& source) : source_(source) {}

  /// Checks an element. `copy`: the element to write to; null if nothing of this element is read.
  void Element(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy) {
    if (!rule.refusal.empty()) Fail(element, place, "", "<" + std::string(rule.name) + "> is refused", rule.refusal);
    Attributes(element, rule, place, copy);
    Children(element, rule, place, copy);
  }

  [[noreturn]] void Fail(const XMLElement& element, const std::string& place, std::string_view value,
                         const std::string& message, std::string_view fix) const {
    throw InputError({source_, place + ", line " + std::to_string(element.GetLineNum()), PrintableUrdfText(value),
                      message, std::string(fix)});
  }

 private:
  void Attributes(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy) {
    std::set<std::string_view> given;
    for (const XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) given.insert(a->Name());
    for (const UrdfAttributeRule& attribute : rule.attributes) Attribute(element, attribute, place, copy);
    std::vector<std::string> absent;
    for (const UrdfAttributeRule& attribute : rule.attributes) {
      if (!given.contains(attribute.name)) absent.emplace_back(attribute.name);
    }
    for (const std::string_view name : given) {
      const bool known = std::any_of(rule.attributes.begin(), rule.attributes.end(),
                                     [name](const UrdfAttributeRule& a) { return a.name == name; });
      if (known || !IsMisspelling(name, absent)) continue;
      Fail(element, place, name, "there is no such attribute", "did you mean '" + NearestName(name, absent) + "'?");
    }
  }

  void Attribute(const XMLElement& element, const UrdfAttributeRule& rule, const std::string& outer, XMLElement* copy) {
    const std::string name{rule.name};
    const std::string place = outer + ": " + name;
    const char* text = element.Attribute(name.c_str());
    if (text == nullptr) {
      if (!rule.required) return;
      Fail(element, place, "", "<" + std::string(element.Name()) + "> without '" + name + "'", "add the attribute");
    }
    if (!rule.refusal.empty()) Fail(element, place, text, "the attribute is not supported", rule.refusal);
    if (FirstInvalidByte(text) != std::string_view::npos) {
      Fail(element, place, text, "is not UTF-8", "save the file as UTF-8, for example with 'iconv -f latin1 -t utf-8'");
    }
    const UrdfValueText checked = CheckUrdfValue(text, rule.value);
    if (checked.fault) Fail(element, place, text, checked.fault->message, checked.fault->fix);
    if (copy != nullptr && rule.read) copy->SetAttribute(name.c_str(), checked.text.c_str());
  }

  void Children(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy) {
    std::vector<int> counts(rule.children.size(), 0);
    for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      const auto known = std::find_if(rule.children.begin(), rule.children.end(),
                                      [name](const UrdfElementRule& child) { return child.name == name; });
      if (known == rule.children.end()) {
        CheckUnknownElement(*e, rule, counts, place);
        continue;
      }
      int& count = counts[static_cast<std::size_t>(known - rule.children.begin())];
      const std::string inside = PlaceOf(*e, place);
      if (++count > known->most) Fail(*e, inside, "", "the element is given twice", "keep one of them");
      XMLElement* child = copy != nullptr && known->read ? copy->InsertNewChildElement(e->Name()) : nullptr;
      Element(*e, *known, inside, child);
    }
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (counts[k] >= rule.children[k].least) continue;
      const std::string missing{rule.children[k].name};
      Fail(element, place, "", "no <" + missing + "> element", "add it");
    }
    if (rule.holds_one) OneChild(element, rule, place);
  }

  /// Ignores an element without a rule. Throws for unexpanded xacro, an unknown shape, and a misspelt element that is
  /// missing.
  void CheckUnknownElement(const XMLElement& element, const UrdfElementRule& rule, const std::vector<int>& counts,
                           const std::string& place) const {
    const std::string_view name = element.Name();
    if (name.starts_with("xacro:")) {
      Fail(element, place, name, "is an xacro element that has not been expanded",
           "expand the file first: xacro FILE.urdf.xacro > robot.urdf");
    }
    std::vector<std::string> wanted;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (counts[k] < rule.children[k].most) wanted.emplace_back(rule.children[k].name);
    }
    if (rule.holds_one) Fail(element, place, name, "is no shape that can be read", SuggestName(name, wanted));
    if (!IsMisspelling(name, wanted)) return;
    Fail(element, place, name, "there is no such element", "did you mean <" + NearestName(name, wanted) + ">?");
  }

  void OneChild(const XMLElement& element, const UrdfElementRule& rule, const std::string& place) const {
    const XMLElement* first = element.FirstChildElement();
    if (first == nullptr) {
      std::string shapes;
      for (const UrdfElementRule& child : rule.children) {
        if (child.refusal.empty()) shapes += (shapes.empty() ? "<" : ", <") + std::string(child.name) + ">";
      }
      Fail(element, place, "", "holds no shape", "give it one of " + shapes);
    }
    const XMLElement* second = first->NextSiblingElement();
    if (second == nullptr) return;
    Fail(*second, place, second->Name(), "holds more than one shape", "give each an element of its own around it");
  }

  const std::string& source_;
};

/// Checks the rules that depend on the joint's type, which the table cannot express.
void CheckJointType(const UrdfWalk& walk, const XMLElement& joint) {
  const std::string place = PlaceOf(joint, "robot");
  const std::string_view type = joint.Attribute("type");
  if (type == "fixed") return;
  const XMLElement* limit = joint.FirstChildElement("limit");
  if (limit == nullptr && type != "continuous") {
    walk.Fail(joint, place, "", "has no <limit>", "add lower and upper limits, or use type continuous");
  }
}

class UrdfCheck {
 public:
  UrdfCheck(const std::string& xml, const std::string& source) : xml_(xml), walk_(source) { checked_.source = source; }

  CheckedUrdf Run() {
    const XMLElement& robot = Parse();
    const UrdfElementRule& rule = UrdfRobotRule();
    tinyxml2::XMLDocument copy;
    XMLElement* root = copy.NewElement("robot");
    copy.InsertEndChild(root);
    walk_.Element(robot, rule, "robot", root);
    checked_.robot = robot.Attribute("name");
    CollectLinks(robot);
    CollectJoints(robot);
    tinyxml2::XMLPrinter printer(nullptr, true);
    copy.Print(&printer);
    checked_.text = printer.CStr();
    CheckUrdfTree(checked_);
    return std::move(checked_);
  }

 private:
  [[noreturn]] void FailFile(const std::string& field, const std::string& message, const std::string& fix) const {
    throw InputError({checked_.source, field, "", message, fix});
  }

  const XMLElement& Parse() {
    if (xml_.size() > kMostBytes) FailFile("", "has more than 16 MiB", "give the description of one robot");
    if (xml_.find('\0') != std::string::npos) FailFile("", "is no text: it has a byte 0", "save it as UTF-8");
    if (document_.Parse(xml_.c_str(), xml_.size()) != tinyxml2::XML_SUCCESS) {
      FailFile("line " + std::to_string(document_.ErrorLineNum()),
               std::string("not valid XML: ") + document_.ErrorName(), "correct the file");
    }
    const XMLElement* root = document_.RootElement();
    if (root == nullptr || root->Name() != std::string_view("robot")) {
      FailFile("<robot>", "there is no <robot> element", "give a URDF file");
    }
    if (const XMLElement* second = root->NextSiblingElement()) {
      FailFile("line " + std::to_string(second->GetLineNum()), "a second element follows <robot>", "remove it");
    }
    return *root;
  }

  void CollectLinks(const XMLElement& robot) {
    for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
      const std::string name = e->Attribute("name");
      if (!names_.insert(name).second) walk_.Fail(*e, "link", name, "two links have this name", "rename one of them");
      checked_.links.push_back(name);
      std::size_t shapes = 0;
      const char* const kind = "collision";
      for (const auto* c = e->FirstChildElement(kind); c != nullptr; c = c->NextSiblingElement(kind)) ++shapes;
      checked_.shapes.push_back(shapes);
    }
    if (checked_.links.empty()) FailFile("<robot>", "the robot has no links", "define at least one link");
    if (checked_.links.size() > kMostLinks) {
      throw InputError({checked_.source, "<robot>", std::to_string(checked_.links.size()) + " links",
                        "a robot may have " + std::to_string(kMostLinks) + " links", "leave out what does not move"});
    }
  }

  void CollectJoints(const XMLElement& robot) {
    std::set<std::string> joint_names;
    for (const auto* e = robot.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
      UrdfJointElement joint{
          .name = e->Attribute("name"), .parent = JointEnd(*e, "parent"), .child = JointEnd(*e, "child")};
      CheckJointType(walk_, *e);
      if (!joint_names.insert(joint.name).second) {
        walk_.Fail(*e, "joint", joint.name, "two joints have this name", "rename one of them");
      }
      const auto [other, fresh] = parent_joint_.emplace(joint.child, joint.name);
      if (!fresh) {
        walk_.Fail(*e, "link '" + PrintableUrdfText(joint.child) + "'", "",
                   "is the child of two joints, '" + PrintableUrdfText(other->second) + "' and '" +
                       PrintableUrdfText(joint.name) + "' (a kinematic loop)",
                   "remove one of the joints");
      }
      checked_.joints.push_back(std::move(joint));
    }
  }

  std::string JointEnd(const XMLElement& joint, const char* end) const {
    const std::string link = joint.FirstChildElement(end)->Attribute("link");
    if (!names_.contains(link)) {
      walk_.Fail(joint, PlaceOf(joint, "robot"), link, std::string(end) + " link does not exist",
                 "define the link or correct the name");
    }
    return link;
  }

  const std::string& xml_;
  UrdfWalk walk_;
  CheckedUrdf checked_;
  tinyxml2::XMLDocument document_;
  std::set<std::string> names_;
  std::map<std::string, std::string> parent_joint_;  ///< keyed by child link
};

}  // namespace

CheckedUrdf CheckUrdf(const std::string& xml, const std::string& source) { return UrdfCheck(xml, source).Run(); }

std::string ReadUrdfFile(const std::string& path) {
  std::string text = ReadFileText(path, kMostBytes);
  if (text.empty()) throw InputError({path, "", "", "the robot description is empty", "give a URDF"});
  return text;
}

namespace {

void AddName(const XMLElement& element, std::string* names) {
  *names += (names->empty() ? "" : ", ") + PrintableUrdfText(element.Attribute("name"));
}

/// Principal moments, ascending.
Eigen::Vector3d PrincipalMoments(const XMLElement& inertia) {
  const auto moment = [&inertia](const char* name) { return inertia.DoubleAttribute(name); };
  Eigen::Matrix3d tensor;
  tensor << moment("ixx"), moment("ixy"), moment("ixz"),  //
      moment("ixy"), moment("iyy"), moment("iyz"),        //
      moment("ixz"), moment("iyz"), moment("izz");
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace

std::vector<UrdfDiagnostic> ReviewUrdf(const CheckedUrdf& urdf) {
  constexpr double kRounding = 0.99;  // margin for tensors written with few digits
  const ClassicNumericLocale point;
  tinyxml2::XMLDocument document;
  document.Parse(urdf.text.c_str(), urdf.text.size());  // cannot fail: CheckUrdf wrote this text
  const XMLElement& robot = *document.RootElement();
  std::string without_axis, not_definite, not_a_body;
  for (const auto* e = robot.FirstChildElement("joint"); e != nullptr; e = e->NextSiblingElement("joint")) {
    const bool moves = e->Attribute("type") != std::string_view("fixed");
    if (moves && e->FirstChildElement("axis") == nullptr) AddName(*e, &without_axis);
  }
  for (const auto* e = robot.FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    const XMLElement* inertial = e->FirstChildElement("inertial");
    if (inertial == nullptr || inertial->FirstChildElement("mass")->DoubleAttribute("value") == 0.0) continue;
    const Eigen::Vector3d moments = PrincipalMoments(*inertial->FirstChildElement("inertia"));
    if (!(moments[0] > 0.0)) {
      AddName(*e, &not_definite);
    } else if (!(moments[0] + moments[1] >= kRounding * moments[2])) {
      AddName(*e, &not_a_body);
    }
  }
  std::vector<UrdfDiagnostic> remarks;
  if (!without_axis.empty()) {
    remarks.push_back({without_axis, "", "have no <axis>: they turn about, or move along, x", "write the axis"});
  }
  if (!not_definite.empty()) {
    remarks.push_back({not_definite, "", "have an inertia that is not positive definite, which nothing here reads",
                       "correct it if other programs use the robot"});
  }
  if (!not_a_body.empty()) {
    remarks.push_back({not_a_body, "",
                       "have a principal moment of inertia above the sum of the others, as no body can; nothing here "
                       "reads it",
                       "correct it if other programs use the robot"});
  }
  return remarks;
}

}  // namespace legopt
