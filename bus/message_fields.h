#pragma once

#include "bus/experiment_fields.h"
#include "bus/frame_fields.h"
#include "bus/job_fields.h"
#include "bus/result_fields.h"
#include "bus/session_fields.h"

/// @file
/// Every field of every message: kFields<Message> is a std::tuple of rows with name, member and rule
/// (field.h), in the order of the .lcm file. For who shows messages (`legopt tap`) and for who checks them
/// (codec.cpp).
