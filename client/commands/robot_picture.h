#pragma once

#include <filesystem>

#include "legopt/import/internal/standing_view.h"

namespace legopt::client {

/// Writes a PNG with the front (left) and the left side (right) of a robot that stands on z = 0: soles and point
/// contacts red, centre of mass blue with a blue line down to the ground.
void WriteRobotPicture(const StandingView& view, const std::filesystem::path& file);

}  // namespace legopt::client
