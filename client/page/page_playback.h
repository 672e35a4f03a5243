#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "client/page/page_solutions.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Samples of a motion on a page: per second, and at most.
inline constexpr double kPlaybackRate_Hz = 50.0;
inline constexpr int kMostPlaybackSamples = 1000;

/// Returns the name of the block with the playback of a job.
std::string PlaybackName(std::int64_t job_id);

/// Computes the shortest time law of a job's motion and returns its samples, or the reason why it cannot be executed,
/// in the format of docs/reference/page-data.md ("playback"). Takes seconds for long motions. The task must be one of
/// motions.
nlohmann::ordered_json PlaybackJson(const Dataset& dataset, const PageJob& job, const PageMotion& motion);

}  // namespace legopt::client
