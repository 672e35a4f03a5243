// The reader of LegOpt problem files: it reads, or throws InputError.
#include "legopt/dataset/problem_definition.h"
#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const legopt::fuzz::InputFile file({reinterpret_cast<const char*>(data), size}, ".json");
  try {
    static_cast<void>(legopt::ReadProblemFile(file.path()));
  } catch (const legopt::InputError&) {
  }
  return 0;
}
