#include "client/commands/commands.h"
#include "legopt/planning/numeric_fingerprint.h"
#include "app/build_identity.h"
#include "app/program_main.h"

int main(int argc, char** argv) {
  return legopt::programs::RunProgram("legopt", legopt::programs::ProcessKind::kCommand, [&] {
    return legopt::client::RunCommandLine(argc, argv, legopt::programs::ThisBuild(legopt::NumericFingerprint()));
  });
}
