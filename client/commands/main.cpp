#include "app/build_identity.h"
#include "app/program_main.h"
#include "client/commands/commands.h"
#include "legopt/planning/internal/numeric_fingerprint.h"

int main(int argc, char** argv) {
  return legopt::app::RunProgram("legopt", legopt::app::ProcessKind::kCommand, [&] {
    return legopt::client::RunCommandLine(argc, argv, legopt::app::ThisBuild(legopt::NumericFingerprint()));
  });
}
