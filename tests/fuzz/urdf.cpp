// The reader of robots: it reads, or throws InputError.
#include <string>

#include "legopt/input_error.h"
#include "legopt/robot/robot_model.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(legopt::RobotModel::FromUrdfText(std::string(reinterpret_cast<const char*>(data), size),
                                                       "robot.urdf", "/nonexistent"));
  } catch (const legopt::InputError&) {
  }
  return 0;
}
