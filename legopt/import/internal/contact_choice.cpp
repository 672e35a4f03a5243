#include "legopt/import/internal/contact_choice.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/import/internal/contact_finder.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

std::string Numbered(const std::vector<std::string>& ends) {
  std::string text;
  for (std::size_t i = 0; i < ends.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(i + 1) + " " + ends[i];
  return text;
}

/// Names contacts like their links, without the characters that separate contacts in a stance.
void NameByLinks(std::vector<ContactDescription>* contacts) {
  std::set<std::string> names;
  for (ContactDescription& contact : *contacts) {
    std::string name = contact.link;
    std::ranges::replace_if(
        name, [](char c) { return c == ',' || c == ' '; }, '_');
    while (!names.insert(name).second) name += "_2";
    contact.name = name;
  }
}

bool TouchesWithCorner(const FoundSole& sole) {
  return sole.contact.kind == ContactKind::kPoint && sole.contact.radius_m == 0.0;
}

class ContactChooser {
 public:
  ContactChooser(const RobotModel& robot, const Eigen::VectorXd& standing, const ContactRequest& request,
                 std::vector<DatasetDiagnostic>* findings)
      : robot_(robot), standing_(standing), request_(request), findings_(*findings) {}

  std::vector<ContactDescription> Choose() {
    if (!request_.known.empty() && request_.wanted.empty() && !request_.sole_offset_m) return request_.known;
    const std::vector<std::string> links = ChooseLinks();
    std::vector<ContactDescription> contacts;
    if (request_.sole_offset_m) {
      contacts = DescribeSoles(links, *request_.sole_offset_m);
    } else {
      contacts = Measured(links);
    }
    NameByLinks(&contacts);
    return contacts;
  }

 private:
  std::vector<std::string> ChooseLinks() {
    if (!request_.wanted.empty()) return WantedLinks();
    std::vector<std::string> links;
    for (const ContactDescription& contact : request_.known) links.push_back(contact.link);
    if (links.empty()) links = request_.used;
    return links.empty() ? FindLinks() : links;
  }

  std::vector<std::string> WantedLinks() const {
    std::vector<std::string> links, ends;
    const auto add = [&](const std::string& link) {
      if (std::ranges::find(links, link) != links.end()) {
        throw InputError({"", "--contacts", link, "is named twice", "name each link once"});
      }
      links.push_back(link);
    };
    for (const std::string& word : request_.wanted) {
      const std::optional<std::size_t> number = ParseInteger<std::size_t>(word);
      if (!number || robot_.FindLink(word) >= 0) {
        add(word);
        continue;
      }
      if (ends.empty()) ends = FindFeet(robot_, standing_).candidates;
      if (*number < 1 || *number > ends.size()) {
        throw InputError({"", "--contacts", word, "is neither a link nor the number of an end of the robot",
                          "choose of: " + Numbered(ends)});
      }
      add(ends[*number - 1]);
    }
    return links;
  }

  std::vector<std::string> FindLinks() {
    FoundFeet found = FindFeet(robot_, standing_);
    const bool doubtful = TouchesWithCorners(found);
    if (found.links.empty() && HaveGeometry(request_.leg_tips)) {
      std::string names;
      for (const std::string& link : request_.leg_tips) names += (names.empty() ? "" : ", ") + link;
      Note("feet", "", names, "found as the ends of the SRDF's legs; others: --contacts LINK,LINK");
      return request_.leg_tips;
    }
    if (found.links.empty() || doubtful) {
      throw UnclearContacts(
          {request_.file.string(), "contacts", "", "are not clear from the robot's geometry",
           found.candidates.empty()
               ? "no end link of the robot has collision geometry; name the links with --contacts"
               : "name them, or give their numbers, with --contacts LEFT,RIGHT; ends of the robot, lowest "
                 "first: " +
                     Numbered(found.candidates)},
          found.candidates);
    }
    std::string names;
    for (const std::string& link : found.links) names += (names.empty() ? "" : ", ") + link;
    Note("feet", "", names, "found as the lowest ends of the robot; others: --contacts LINK,LINK");
    return found.links;
  }

  /// Returns true for two or more links with collision geometry.
  bool HaveGeometry(const std::vector<std::string>& links) const {
    return links.size() >= 2 && std::ranges::all_of(links, [&](const std::string& link) {
             return !robot_.links()[static_cast<std::size_t>(robot_.FindLink(link))].collision.empty();
           });
  }

  /// Returns true if all ends that were taken for feet touch with a corner although another end has a sole, as of a
  /// robot whose hands reach below its feet.
  bool TouchesWithCorners(const FoundFeet& found) const {
    constexpr double kSole_m2 = 2e-3;
    if (found.links.empty() || !std::ranges::all_of(SolesOf(found.links), &TouchesWithCorner)) return false;
    return std::ranges::any_of(found.candidates, [&](const std::string& link) {
      return std::ranges::find(found.links, link) == found.links.end() &&
             MeasureSole(robot_, robot_.FindLink(link), standing_).area_m2 >= kSole_m2;
    });
  }

  std::vector<ContactDescription> Measured(const std::vector<std::string>& links) {
    std::vector<ContactDescription> contacts;
    for (const std::string& link : links) {
      if (robot_.FindLink(link) < 0) return DescribeSoles(links, 0.0);  // Dataset::Load reports the nearest valid link
    }
    for (const FoundSole& sole : SolesOf(links)) {
      NoteMeasure(sole);
      contacts.push_back(sole.contact);
    }
    return contacts;
  }

  /// A robot cannot stand on the corners of two feet, so soles up to 60 degrees steep are tried then.
  std::vector<FoundSole> SolesOf(const std::vector<std::string>& links) const {
    constexpr double kSteep_rad = std::numbers::pi / 3.0;
    const auto measured = [&](double steepest_rad) {
      std::vector<FoundSole> soles;
      for (const std::string& link : links) {
        soles.push_back(MeasureSole(robot_, robot_.FindLink(link), standing_, steepest_rad));
      }
      return soles;
    };
    const std::vector<FoundSole> soles = measured(kSteepestSole_rad);
    if (links.size() > 2 || !std::ranges::all_of(soles, &TouchesWithCorner)) return soles;
    const std::vector<FoundSole> steep = measured(kSteep_rad);
    return std::ranges::any_of(steep, &TouchesWithCorner) ? soles : steep;
  }

  void NoteMeasure(const FoundSole& sole) {
    constexpr double kSquareCentimetres = 1e4, kDegrees = 180.0 / std::numbers::pi, kMillimetres = 1e3;
    const std::string& name = sole.contact.link;
    if (sole.contact.kind == ContactKind::kPoint) {
      Note("contact", name, "a point of radius " + FormatFixed(kMillimetres * sole.contact.radius_m, 1) + " mm",
           "measured on its shapes; the link may turn about it");
    } else if (sole.contact.points) {  // without geometry, which Dataset::Load reports, there are none
      Note("contact", name, FormatFixed(kSquareCentimetres * sole.area_m2, 0) + " cm2",
           "measured on its meshes; the link's origin is " + FormatFixed(kMillimetres * sole.height_m, 1) +
               " mm above it, its z axis " + FormatFixed(kDegrees * sole.tilt_rad, 1) + " deg off its normal");
    }
  }

  void Note(const std::string& check, const std::string& field, const std::string& value, const std::string& message) {
    findings_.push_back({DatasetDiagnostic::Severity::kInfo, check, "", field, value, message, ""});
  }

  const RobotModel& robot_;
  const Eigen::VectorXd& standing_;
  const ContactRequest& request_;
  std::vector<DatasetDiagnostic>& findings_;
};

}  // namespace

std::vector<ContactDescription> ChooseContacts(const RobotModel& robot, const Eigen::VectorXd& standing,
                                               const ContactRequest& request,
                                               std::vector<DatasetDiagnostic>* findings) {
  return ContactChooser(robot, standing, request, findings).Choose();
}

}  // namespace legopt
