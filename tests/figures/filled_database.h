// A deployment whose database holds many results, created in seconds: the jobs are submitted to a real server, and the
// results are written by SQL while it is stopped.
#pragma once

#include <memory>

#include "tests/service/deployment.h"

namespace legopt::figures {

/// Returns a deployment with one experiment of `results` finished jobs and `open` queued ones and a stopped server.
/// Throws std::runtime_error.
std::unique_ptr<service::Deployment> FilledDeployment(int results, int open);

}  // namespace legopt::figures
