// One legal message of every type, with every field set and every array filled.
#pragma once

#include "bus/messages.h"

namespace legopt::bus {

template <class Message>
Message Sample();

}  // namespace legopt::bus
