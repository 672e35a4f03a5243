#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace legopt::service {

/// The embedded dataset of this source tree.
std::filesystem::path DefaultDataset();

/// SQP with two restarts, from both starts, on all posture problems of the embedded dataset, `repetitions` times;
/// nothing is taken over.
nlohmann::json PostureSpec(int repetitions);

}  // namespace legopt::service
