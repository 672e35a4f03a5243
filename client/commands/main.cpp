#include "client/commands/commands.h"
#include "legopt/solve/numeric_fingerprint.h"
#include "programs/build_identity.h"
#include "programs/program_main.h"

int main(int argc, char** argv) {
  return legopt::programs::RunProgram("legopt", legopt::programs::ProcessKind::kCommand, [&] {
    return legopt::client::RunCommandLine(argc, argv, legopt::programs::ThisBuild(legopt::NumericFingerprint()));
  });
}
