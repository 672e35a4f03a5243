#include "legopt/robot/internal/urdf_walk.h"

#include <algorithm>
#include <map>
#include <set>

#include "legopt/input/text.h"
#include "legopt/types/nearest_name.h"

namespace legopt {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

/// Lines of one kind of fault in a message.
constexpr std::size_t kShown = 3;

std::string Joined(const std::vector<std::string>& places) {
  std::string text;
  for (std::size_t i = 0; i < std::min(places.size(), kShown); ++i) text += (i == 0 ? "" : "; ") + places[i];
  if (places.size() > kShown) text += "; and " + std::to_string(places.size() - kShown) + " more";
  return text;
}

}  // namespace

void UrdfFaults::Refuse(const std::string& place, std::string_view value, const std::string& message,
                        std::string_view fix) {
  refused_.push_back({source_, place, PrintableUrdfText(value), message, std::string(fix)});
}

void UrdfFaults::Note(UrdfSeverity severity, const std::string& place, std::string_view value,
                      const std::string& message, std::string_view fix) {
  const auto same = [&](const Group& group) { return group.first.message == message; };
  auto group = std::ranges::find_if(groups_, same);
  if (group == groups_.end()) {
    groups_.push_back({{severity, "", PrintableUrdfText(value), message, std::string(fix)}, {}});
    group = groups_.end() - 1;
  }
  group->places.push_back(place);
}

void UrdfFaults::Check() const {
  if (refused_.empty()) return;
  std::map<std::string, std::size_t> count;
  for (const InputError::Fault& fault : refused_) ++count[fault.message];
  std::map<std::string, std::size_t> listed;
  std::vector<InputError::Fault> shown;
  for (InputError::Fault fault : refused_) {
    const std::size_t number = ++listed[fault.message];
    if (number > kShown) continue;
    if (number == kShown && count[fault.message] > kShown) {
      fault.field += ", and " + std::to_string(count[fault.message] - kShown) + " more";
    }
    shown.push_back(std::move(fault));
  }
  throw InputError::Of(std::move(shown));
}

std::vector<UrdfDiagnostic> UrdfFaults::notes() const {
  std::vector<UrdfDiagnostic> all;
  for (const Group& group : groups_) {
    all.push_back(group.first);
    all.back().field = Joined(group.places);
    if (group.places.size() > 1) all.back().value.clear();
  }
  return all;
}

std::string UrdfPlaceOf(const XMLElement& element, const std::string& outer) {
  const char* name = element.Attribute("name");
  const std::string_view kind = element.Name();
  const bool titled = kind == "link" || kind == "joint" || (kind == "material" && outer == "robot");
  const std::string own = std::string(kind) + (titled && name != nullptr ? " '" + PrintableUrdfText(name) + "'" : "");
  return titled || outer.empty() ? own : outer + ": " + own;
}

std::string WithLine(const std::string& place, const XMLElement& element) {
  return place + ", line " + std::to_string(element.GetLineNum());
}

namespace {

class UrdfWalk {
 public:
  explicit UrdfWalk(UrdfFaults* faults) : faults_(*faults) {}

  void Element(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy) {
    if (!rule.refusal.empty()) {
      Fail(element, place, "", "<" + std::string(rule.name) + "> is refused", rule.refusal, copy);
      return;
    }
    for (const UrdfAttributeRule& attribute : rule.attributes) Attribute(element, attribute, place, copy);
    Misspellings(element, rule, place, copy);
    Children(element, rule, place, copy);
  }

 private:
  void Fail(const XMLElement& element, const std::string& place, std::string_view value, const std::string& message,
            std::string_view fix, const XMLElement* copy) {
    if (copy != nullptr) {
      faults_.Refuse(WithLine(place, element), value, message, fix);
    } else {
      faults_.Note(UrdfSeverity::kInfo, WithLine(place, element), "", "have faults, but are not used");
    }
  }

  void Warn(const XMLElement& element, const std::string& place, std::string_view value, const std::string& message) {
    faults_.Note(UrdfSeverity::kWarning, WithLine(place, element), value, message + "; it is not used");
  }

  void Repair(const XMLElement& element, const std::string& place, std::string_view value, const std::string& message,
              const XMLElement* copy) {
    if (copy != nullptr) faults_.Note(UrdfSeverity::kWarning, WithLine(place, element), value, message);
  }

  void Misspellings(const XMLElement& element, const UrdfElementRule& rule, const std::string& place,
                    const XMLElement* copy) {
    std::set<std::string_view> given;
    for (const XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) given.insert(a->Name());
    std::vector<std::string> absent;
    for (const UrdfAttributeRule& attribute : rule.attributes) {
      if (!given.contains(attribute.name)) absent.emplace_back(attribute.name);
    }
    for (const std::string_view name : given) {
      const bool known = std::any_of(rule.attributes.begin(), rule.attributes.end(),
                                     [name](const UrdfAttributeRule& a) { return a.name == name; });
      if (known || !IsMisspelling(name, absent)) continue;
      Fail(element, place, name, "there is no such attribute", "did you mean '" + NearestName(name, absent) + "'?",
           copy);
    }
  }

  void Attribute(const XMLElement& element, const UrdfAttributeRule& rule, const std::string& outer, XMLElement* copy) {
    const std::string name{rule.name};
    const std::string place = outer + ": " + name;
    XMLElement* target = rule.read ? copy : nullptr;
    const char* text = element.Attribute(name.c_str());
    if (text == nullptr && !rule.required) return;
    if (text == nullptr && !rule.replacement.empty()) {
      Repair(element, place, "", "missing; set to " + std::string(rule.replacement), target);
      if (target != nullptr) target->SetAttribute(name.c_str(), std::string(rule.replacement).c_str());
      return;
    }
    const bool warns = target == nullptr && rule.doubtful;
    if (text == nullptr) {
      const std::string message = "<" + std::string(element.Name()) + "> without '" + name + "'";
      if (warns) return Warn(element, place, "", message);
      return Fail(element, place, "", message, "add the attribute", target);
    }
    if (!rule.refusal.empty()) {
      Fail(element, place, text, "the attribute is not supported", rule.refusal, target);
      return;
    }
    if (FirstInvalidByte(text) != std::string_view::npos) {
      Fail(element, place, text, "is not UTF-8", "save the file as UTF-8, for example with 'iconv -f latin1 -t utf-8'",
           target);
      return;
    }
    std::string repaired = text;
    if (ReplaceSpecialNumbers(rule, &repaired)) {
      const bool number = rule.value == UrdfValue::kNumber;
      Repair(element, place, text,
             number ? "means no limit; written as " + repaired : "means 0; written as " + std::string(rule.zero),
             target);
    }
    if (RepeatNumber(rule, &repaired)) Note(element, place, "has one number; it counts for all three axes", target);
    const UrdfValueText checked = CheckUrdfValue(repaired, rule.value);
    if (checked.fault) {
      if (warns) return Warn(element, place, text, checked.fault->message);
      return Fail(element, place, text, checked.fault->message, checked.fault->fix, target);
    }
    if (target != nullptr) target->SetAttribute(name.c_str(), checked.text.c_str());
  }

  void Children(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy) {
    std::vector<int> counts(rule.children.size(), 0);
    std::vector<const XMLElement*> unknown;
    for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      const auto known = std::find_if(rule.children.begin(), rule.children.end(),
                                      [name](const UrdfElementRule& child) { return child.name == name; });
      if (known == rule.children.end()) {
        unknown.push_back(e);
        continue;
      }
      const std::string inside = UrdfPlaceOf(*e, place);
      XMLElement* reader = known->read ? copy : nullptr;
      if (known->may_be_empty && IsEmptyShape(*e)) {
        Note(*e, inside, "has no shape; left out", reader);
        continue;
      }
      int& count = counts[static_cast<std::size_t>(known - rule.children.begin())];
      if (++count > known->most && !rule.holds_one) {
        Note(*e, inside, "given twice; the first one counts", reader);
        continue;
      }
      XMLElement* child = reader != nullptr ? reader->InsertNewChildElement(e->Name()) : nullptr;
      Element(*e, *known, inside, child);
    }
    const auto num_known = std::count_if(counts.begin(), counts.end(), [](int count) { return count > 0; });
    for (const XMLElement* e : unknown) UnknownElement(*e, rule, counts, place, num_known > 0, copy);
    for (std::size_t k = 0; k < counts.size(); ++k) {
      const UrdfElementRule& child = rule.children[k];
      if (counts[k] >= child.least) continue;
      if (!child.replacement.empty()) {
        Note(element, place, "no <" + std::string(child.name) + ">; set to zero", copy);
        if (copy != nullptr) AddZeros(child, copy);
        continue;
      }
      Fail(element, place, "", "no <" + std::string(child.name) + "> element", "add it", copy);
    }
    if (rule.holds_one) OneChild(element, rule, place, counts, unknown.empty(), copy);
  }

  void Note(const XMLElement& element, const std::string& place, const std::string& message, const XMLElement* copy) {
    if (copy == nullptr) return Fail(element, place, "", message, "", copy);
    faults_.Note(UrdfSeverity::kWarning, WithLine(place, element), "", message);
  }

  static void AddZeros(const UrdfElementRule& rule, XMLElement* copy) {
    XMLElement* element = copy->InsertNewChildElement(std::string(rule.name).c_str());
    for (const UrdfAttributeRule& attribute : rule.attributes) {
      element->SetAttribute(std::string(attribute.name).c_str(), std::string(rule.replacement).c_str());
    }
  }

  /// True for a <collision> or <visual> that holds nothing, or an empty <geometry>.
  static bool IsEmptyShape(const XMLElement& element) {
    const XMLElement* geometry = element.FirstChildElement("geometry");
    if (geometry != nullptr) return geometry->FirstChildElement() == nullptr;
    for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (e->Name() != std::string_view("origin")) return false;
    }
    return true;
  }

  /// Ignores an element without a rule, unless it is unexpanded xacro, the only shape, or a misspelt element that is
  /// missing.
  void UnknownElement(const XMLElement& element, const UrdfElementRule& rule, const std::vector<int>& counts,
                      const std::string& place, bool has_known, const XMLElement* copy) {
    const std::string_view name = element.Name();
    if (name.starts_with("xacro:")) {
      constexpr std::array<std::string_view, 4> kDefinitions = {"xacro:property", "xacro:macro", "xacro:arg",
                                                                "xacro:include"};
      if (std::ranges::find(kDefinitions, name) != kDefinitions.end()) {
        faults_.Note(UrdfSeverity::kInfo, WithLine(place, element), name, "is left over from xacro and does nothing");
        return;
      }
      if (place == "robot") {  // urdfdom ignores it; if links are missing without it, the robot is not connected
        faults_.Note(UrdfSeverity::kWarning, WithLine(place, element), name,
                     "is an xacro call that has not been expanded; what it would add is missing");
        return;
      }
      return Fail(element, place, name, "is an xacro element that has not been expanded",
                  "expand the file first: xacro FILE.urdf.xacro > robot.urdf", copy);
    }
    std::vector<std::string> wanted;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (counts[k] < rule.children[k].most) wanted.emplace_back(rule.children[k].name);
    }
    if (rule.holds_one && has_known) {
      Note(element, place, "<" + std::string(name) + "> beside a shape is not read", copy);
    } else if (rule.holds_one) {
      Fail(element, place, name, "is no shape that can be read", SuggestName(name, wanted), copy);
    } else if (IsMisspelling(name, wanted)) {
      Fail(element, place, name, "there is no such element", "did you mean <" + NearestName(name, wanted) + ">?", copy);
    }
  }

  void OneChild(const XMLElement& element, const UrdfElementRule& rule, const std::string& place,
                const std::vector<int>& counts, bool all_known, const XMLElement* copy) {
    int shapes = 0;
    for (const int count : counts) shapes += count;
    if (shapes == 0 && all_known) {
      std::string names;
      for (const UrdfElementRule& child : rule.children) {
        if (child.refusal.empty()) names += (names.empty() ? "<" : ", <") + std::string(child.name) + ">";
      }
      Fail(element, place, "", "holds no shape", "give it one of " + names, copy);
    }
    if (shapes < 2) return;
    const XMLElement& second = *element.FirstChildElement()->NextSiblingElement();
    Fail(second, place, second.Name(), "holds more than one shape", "give each an element of its own around it", copy);
  }

  UrdfFaults& faults_;
};

}  // namespace

void WalkUrdf(const XMLElement& element, const UrdfElementRule& rule, const std::string& place, XMLElement* copy,
              UrdfFaults* faults) {
  UrdfWalk(faults).Element(element, rule, place, copy);
}

}  // namespace legopt
