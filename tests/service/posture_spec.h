#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace legopt::service {

/// Returns the embedded dataset of this source tree.
std::filesystem::path DefaultDataset();

/// Returns a specification of SQP with two restarts, from both initial guesses, on all posture problems of the
/// embedded dataset, `repetitions` times, without reuse of results.
nlohmann::json PostureSpec(int repetitions);

}  // namespace legopt::service
