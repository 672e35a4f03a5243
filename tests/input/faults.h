#pragma once

#include <string>

#include "legopt/types/input_error.h"

namespace legopt::test {

/// Returns the message of the InputError that `call` throws; empty if it throws none.
template <class Call>
std::string FaultOf(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace legopt::test
