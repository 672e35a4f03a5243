// A deployment whose database holds many results, made in seconds: the jobs are submitted to a real server, the results
// written by SQL while it is down.
#pragma once

#include <memory>

#include "tests/service/deployment.h"

namespace legopt::figures {

/// One experiment of `results` finished jobs and `open` queued ones; the server is down. Throws std::runtime_error.
std::unique_ptr<service::Deployment> FilledDeployment(int results, int open);

}  // namespace legopt::figures
