#pragma once

#include "bus/fields/experiments.h"
#include "bus/fields/frames.h"
#include "bus/fields/jobs.h"
#include "bus/fields/results.h"
#include "bus/fields/sessions.h"

/// Every field of every message: kFields<Message> is a std::tuple of rows with name, member and rule
/// (fields/field.h), in the order of the .lcm file. For who shows messages (`legopt tap`) and for who checks them
/// (codec.cpp).
