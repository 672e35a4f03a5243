#include "client/commands/commands.h"
#include "legopt/solve/numeric_fingerprint.h"
#include "programs/build_identity.h"

int main(int argc, char** argv) {
  return legopt::client::RunCommandLine(argc, argv, legopt::programs::ThisBuild(legopt::NumericFingerprint()));
}
