#pragma once

#include <filesystem>

#include "legopt/import/internal/standing_view.h"

namespace legopt::client {

/// Draws a robot on level ground, z = 0, as a PNG: its front in the left half, its left side in the right half. Soles
/// and point contacts are red; the centre of mass is blue, with a blue line down to the ground.
void WriteRobotPicture(const StandingView& view, const std::filesystem::path& file);

}  // namespace legopt::client
