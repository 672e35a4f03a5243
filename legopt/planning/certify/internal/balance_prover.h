#pragma once

#include <optional>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"

namespace legopt::certify {

/// Returns why no posture balances a stance, in a sentence, or nothing:
/// - hands carry, and no forces within friction and bounds balance the weight (SlideProof), or
/// - the centre of mass must be in the stance's polygon, which is further from a contact than its Contact::com_reach_m.
std::optional<std::string> RefuteBalance(const Dataset& dataset, const Stance& stance);

}  // namespace legopt::certify
