// The reader of experiment files: it reads, or throws InputError.
#include "client/suite/suite.h"

#include <string>

#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(legopt::client::ParseSuite(std::string(reinterpret_cast<const char*>(data), size), "suite.yaml"));
  } catch (const legopt::InputError&) {
  }
  return 0;
}
