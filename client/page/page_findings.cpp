#include "client/page/page_findings.h"

#include <cmath>

#include "legopt/robot/dof_names.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

// A ten-millionth of a metre is smaller than anything displayed.
Json RoundedJson(double value) {
  constexpr double kRounding = 1e-7;
  return std::isfinite(value) ? Json(std::round(value / kRounding) * kRounding) : Json();
}

template <class Vector>
Json VectorJson(const Vector& vector) {
  Json json = Json::array();
  for (const double value : vector) json.push_back(RoundedJson(value));
  return json;
}

Json FootJson(const FootDiagnostic& foot) {
  constexpr const char* kComponents[] = {"rotation x",    "rotation y",    "rotation z",
                                         "translation x", "translation y", "translation z"};
  return {{"link", foot.link},
          {"error", RoundedJson(foot.violation)},
          {"component", kComponents[foot.component]},
          {"violated", foot.violated}};
}

Json LimitJson(const LimitDiagnostic& limit, const RobotModel& robot) {
  const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(limit.dof))];
  return {{"joint", joint.name},
          {"unit", UnitOf(joint.type)},
          {"link", joint.child_link},
          {"value", RoundedJson(limit.value)},
          {"limit", RoundedJson(limit.limit)},
          {"excess", RoundedJson(limit.excess)},
          {"violated", limit.violated}};
}

Json ValueJson(const CheckDiagnostic& finding) {
  const CheckDescription& check = DescriptionOf(finding.value.check);
  return {{"check", check.name}, {"subject", finding.value.subject}, {"value", RoundedJson(finding.value.value)},
          {"unit", check.unit},  {"tolerance", check.tolerance},     {"violated", finding.violated}};
}

}  // namespace

Json OverlapsJson(const std::vector<OverlapDiagnostic>& overlaps, const Dataset& dataset) {
  Json list = Json::array();
  for (const OverlapDiagnostic& finding : overlaps) {
    const ExactCollision::Overlap& overlap = finding.overlap;
    Json json = {{"link", overlap.link}};
    if (overlap.other_link >= 0) {
      json["other"] = overlap.other_link;
    } else {
      json["object"] = overlap.object;
    }
    json["names"] = {dataset.robot().links()[static_cast<std::size_t>(overlap.link)].name,
                     overlap.other_link >= 0
                         ? dataset.robot().links()[static_cast<std::size_t>(overlap.other_link)].name
                         : dataset.scene().objects[static_cast<std::size_t>(overlap.object)].name};
    json["depth_m"] = overlap.depth_m < 0.0 ? Json() : RoundedJson(overlap.depth_m);
    json["literal_m"] = overlap.literal_m < 0.0 ? Json() : RoundedJson(overlap.literal_m);
    json["inside_m"] = RoundedJson(overlap.inside_m);
    json["fails"] = finding.fails ? Json(ToString(*finding.fails)) : Json();
    if (overlap.point_W.allFinite()) json["points"] = {VectorJson(overlap.point_W), VectorJson(overlap.other_point_W)};
    list.push_back(std::move(json));
  }
  return list;
}

Json FindingsJson(const WaypointDiagnostics& findings, const Dataset& dataset) {
  Json feet = Json::array(), limits = Json::array(), polygon = Json::array(), values = Json::array();
  for (const CheckDiagnostic& value : findings.values) values.push_back(ValueJson(value));
  for (const FootDiagnostic& foot : findings.feet) feet.push_back(FootJson(foot));
  for (const LimitDiagnostic& limit : findings.limits) limits.push_back(LimitJson(limit, dataset.robot()));
  for (const Eigen::Vector2d& corner : findings.polygon_W) polygon.push_back(VectorJson(corner));
  return {{"feet", feet},
          {"com", VectorJson(findings.com_W)},
          {"polygon", polygon},
          {"com_m", RoundedJson(findings.com_m)},
          {"com_violated", findings.com_violated},
          {"limits", limits},
          {"overlaps", OverlapsJson(findings.overlaps, dataset)},
          {"values", values}};
}

}  // namespace legopt::client
