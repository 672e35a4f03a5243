#pragma once

#include <string>

#include "legopt/dataset/dataset.h"

namespace legopt::client {

// Sections of a data sheet: robot, scene and problems of a dataset.

std::string ProblemSection(const Dataset& dataset);  ///< counts by task, family and level
std::string ContactSection(const Dataset& dataset);  ///< contacts with kind and friction, and their use
std::string RobotSection(const Dataset& dataset);    ///< mass, sizes and limits of the joints
/// Histograms of the columns of features.csv; empty if there is no such file. Throws InputError.
std::string FeatureSection(const Dataset& dataset);

}  // namespace legopt::client
