#include "legopt/solve/numeric_fingerprint.h"
#include "worker/solve_executor.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  return legopt::worker::WorkerMain(argc, argv, legopt::programs::ThisBuild(legopt::NumericFingerprint()),
                                    [](std::vector<std::filesystem::path> folders) {
                                      return std::make_unique<legopt::worker::SolveExecutor>(std::move(folders));
                                    });
}
