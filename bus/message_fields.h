#pragma once

#include "bus/experiment_fields.h"
#include "bus/frame_fields.h"
#include "bus/job_fields.h"
#include "bus/result_fields.h"
#include "bus/session_fields.h"

/// @file
/// All fields of all messages: kFields<Message> is a std::tuple of rows with name, member and rule (field.h), in the
/// order of the .lcm file. For code that displays messages (`legopt service tap`) or validates them (codec.cpp).
