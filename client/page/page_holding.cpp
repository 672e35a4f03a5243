#include "client/page/page_holding.h"

#include <cmath>

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLength_m = 1e-4, kForce_N = 1e-2, kShare = 1e-4;  // units of rounding

Json MovementJson(const SurfaceMovement& movement) {
  Json json = {{"movement", ToString(movement.movement)}, {"at", RoundedVectorJson(kLength_m, movement.position_W)}};
  if (movement.movement == ContactMovement::kRests) return json;
  json["direction"] = RoundedVectorJson(kShare, movement.direction_W);
  json["speed"] = RoundedTo(kShare, movement.speed);
  return json;
}

Json ContactJson(const ContactHolding& contact) {
  Json json = {{"contact", contact.contact},
               {"normal", RoundedVectorJson(kShare, contact.normal_W)},
               {"friction", contact.friction ? Json(*contact.friction) : Json()}};
  Json forces = Json::array();
  for (const PointForce& force : contact.forces) {
    forces.push_back({{"at", RoundedVectorJson(kLength_m, force.position_W)},
                      {"force_N", RoundedVectorJson(kForce_N, force.force_N)}});
  }
  json["forces"] = std::move(forces);
  if (contact.moves) json["collapse"] = MovementJson(*contact.moves);
  return json;
}

}  // namespace

Json RoundedTo(double unit, double value) {
  // A quotient has the shortest decimal text; a product with 1e-4 has not.
  return std::isfinite(value) ? Json(std::round(value / unit) / std::round(1.0 / unit)) : Json();
}

Json HoldingJson(const HoldingDiagnostic& holding, bool with_polygon) {
  Json contacts = Json::array();
  for (const ContactHolding& contact : holding.contacts) contacts.push_back(ContactJson(contact));
  Json json = {{"balanced", holding.balanced}, {"contacts", contacts}};
  if (with_polygon) {
    Json polygon = Json::array();
    for (const Eigen::Vector2d& corner : holding.polygon_W) polygon.push_back(RoundedVectorJson(kLength_m, corner));
    json["polygon"] = std::move(polygon);
  }
  if (holding.balanced) {
    json["torque_ratio"] = RoundedTo(kShare, holding.torques.ratio);
    json["torques"] = RoundedVectorJson(kForce_N, holding.torques.torques);
    json["overloaded"] = holding.overloaded;
  }
  if (holding.com_direction_W) json["com_direction"] = RoundedVectorJson(kShare, *holding.com_direction_W);
  return json;
}

Json LimitsJson(const Eigen::VectorXd& limits) {
  Json json = Json::array();
  for (const double limit : limits) json.push_back(std::isfinite(limit) && limit > 0.0 ? Json(limit) : Json());
  return json;
}

}  // namespace legopt::client
