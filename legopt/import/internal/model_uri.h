#pragma once

#include <filesystem>
#include <string>

namespace legopt {

/// Returns the file or folder that a model://, file://, package:// or relative URI of a Gazebo world in `folder` names:
/// in the folder, in its subfolder `models`, and in the same two places of the three folders above. Empty if there
/// is none.
std::filesystem::path FindByUri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace legopt
