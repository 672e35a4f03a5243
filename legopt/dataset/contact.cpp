#include "legopt/dataset/contact.h"

#include "legopt/dataset/stance.h"

namespace legopt {
namespace {

Eigen::Isometry3d FrameOf(const ContactDescription& description) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translation() = description.position;
  const Eigen::Vector3d& rpy = description.rpy_rad;
  if (!rpy.isZero(0.0)) {  // a product of unit quaternions is not exactly the identity
    frame.linear() =
        (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
  }
  return frame;
}

std::vector<Eigen::Vector3d> LowerCorners(const Eigen::AlignedBox3d& box) {
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {box.min().x(), box.max().x()}) {
    for (const double y : {box.min().y(), box.max().y()}) corners.emplace_back(x, y, box.min().z());
  }
  return corners;
}

}  // namespace

Eigen::AlignedBox2d Contact::Patch() const {
  const Eigen::Isometry3d X_CL = X_LC.inverse();
  Eigen::AlignedBox2d patch;
  for (const Eigen::Vector3d& point : points_L) patch.extend((X_CL * point).head<2>().eval());
  return patch;
}

Eigen::Isometry3d Contact::LinkTarget(const ContactTarget& target) const {
  const Eigen::Matrix3d R_WC = target.rotation.normalized().toRotationMatrix();
  const Eigen::Isometry3d X_CL = X_LC.inverse();
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  X_WL.linear() = R_WC * X_CL.linear();
  X_WL.translation() = target.position + R_WC * X_CL.translation();
  return X_WL;
}

std::vector<ContactDescription> DescribeSoles(const std::vector<std::string>& links, double sole_offset_m) {
  std::vector<ContactDescription> contacts;
  for (const std::string& link : links) {
    ContactDescription& contact = contacts.emplace_back();
    contact.name = contact.link = link;
    contact.position.z() = -sole_offset_m;
  }
  return contacts;
}

std::optional<double> CommonSoleOffset_m(const std::vector<ContactDescription>& contacts) {
  if (contacts.empty()) return {};
  const double offset_m = 0.0 - contacts.front().position.z();  // never -0
  std::vector<std::string> links;
  for (const ContactDescription& contact : contacts) links.push_back(contact.link);
  if (!(offset_m >= 0.0) || contacts != DescribeSoles(links, offset_m)) return {};
  return offset_m;
}

Contact ResolveContact(const ContactDescription& description, int link_index, const Eigen::AlignedBox3d& link_box) {
  Contact contact{.name = description.name,
                  .link = description.link,
                  .link_index = link_index,
                  .kind = description.kind,
                  .X_LC = FrameOf(description),
                  .points_L = {},
                  .box_L = link_box,
                  .friction = description.friction,
                  .max_normal_N = description.max_normal_N};
  if (!description.points) {
    contact.points_L = LowerCorners(link_box);
  } else {
    for (const Eigen::Vector3d& point : *description.points) contact.points_L.push_back(contact.X_LC * point);
  }
  return contact;
}

}  // namespace legopt
