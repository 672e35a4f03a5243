#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"

namespace legopt {

/// Inputs of the choice of contacts.
struct ContactRequest {
  std::vector<std::string> wanted;        ///< links, or numbers of ends (FoundFeet::candidates), named by the user
  std::optional<double> sole_offset_m;    ///< height of the link frames above their targets, for parallel frames
  std::vector<ContactDescription> known;  ///< contacts of the source or of the benchmark's robot
  std::vector<std::string> used;          ///< links that problems name
  std::vector<std::string> leg_tips;      ///< ends of legs by the SRDF, for robots whose geometry does not show them
  std::filesystem::path file;             ///< the robot's, for errors
};

/// The feet are not clear from the robot's geometry.
class UnclearContacts : public InputError {
 public:
  /// `ends`: of the robot, lowest first; may be empty.
  UnclearContacts(Fault fault, std::vector<std::string> ends) : InputError(std::move(fault)), ends_(std::move(ends)) {}
  const std::vector<std::string>& ends() const { return ends_; }

 private:
  std::vector<std::string> ends_;
};

/// Chooses the contacts: the known ones, unless the user names others or an offset; else the links that the user names,
/// those that the problems use, or those found (contact_finder.h), each measured in `standing` (n + 7). Adds what was
/// found and measured to `findings`. Ends that touch with a corner are not clear if another end has a sole.
///
/// Throws UnclearContacts with a numbered list of the robot's ends, and InputError for a number that is not in it.
std::vector<ContactDescription> ChooseContacts(const RobotModel& robot, const Eigen::VectorXd& standing,
                                               const ContactRequest& request, std::vector<DatasetDiagnostic>* findings);

}  // namespace legopt
