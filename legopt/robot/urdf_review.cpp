#include "legopt/robot/urdf_review.h"

#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <string_view>

#include "legopt/robot/urdf_values.h"
#include "legopt/types/numeric_locale.h"

namespace legopt {
namespace {

using tinyxml2::XMLElement;

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
