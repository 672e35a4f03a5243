#pragma once

#include <string>

#include "client/report/sampled_motion.h"
#include "legopt/dataset/dataset.h"
#include "legopt/types/enum_names.h"
#include "legopt/types/task.h"

namespace legopt {
namespace client {

/// Formats of a sampled motion (docs/reference/motion-files.md).
enum class MotionFormat {
  kCsv,      ///< one row per sample
  kJson,     ///< samples with a description of robot and limits
  kContacts  ///< JSON: phases with their contacts
};

}  // namespace client

template <>
inline constexpr auto kEnumNames<client::MotionFormat> =
    MakeEnumNames<client::MotionFormat>({{client::MotionFormat::kCsv, "csv"},
                                         {client::MotionFormat::kJson, "json"},
                                         {client::MotionFormat::kContacts, "contacts"}});

}  // namespace legopt

namespace legopt::client {

/// Origin of a motion.
struct MotionOrigin {
  Task task{};
  int problem_id = 0;
  std::string method;
};

/// Returns the text of a file. `motion` must have samples.
std::string FormatMotion(const Dataset& dataset, const MotionOrigin& origin, const SampledMotion& motion,
                         MotionFormat format);

}  // namespace legopt::client
