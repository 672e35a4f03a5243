// The reader of robots: it reads, or throws InputError. Texts that pass the check are read by urdfdom completely and
// without messages. urdfdom runs in the calling process, so it must not crash on any checked text.
#include <string>

#include "legopt/robot/internal/urdf_reader.h"
#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

legopt::UrdfContent Read(const legopt::CheckedUrdf& urdf) {
  try {
    return legopt::ReadByUrdfdom(urdf);
  } catch (const legopt::InputError& error) {
    legopt::fuzz::Require(false, error.what());
  }
  return {};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::string xml(reinterpret_cast<const char*>(data), size);
    const legopt::CheckedUrdf urdf = legopt::CheckUrdf(xml, "robot.urdf");
    legopt::fuzz::Require(legopt::CheckUrdf(urdf.text, "robot.urdf").text == urdf.text, "a checked text is checked");
    static_cast<void>(legopt::BuildUrdfTree(urdf, Read(urdf), "/nonexistent"));
  } catch (const legopt::InputError&) {
  }
  return 0;
}
