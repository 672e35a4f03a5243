#pragma once

#include "worker/job_executor.h"

namespace legopt::worker {

/// Main function of a job process: loads the executor's datasets, then runs jobs received on `fd` until the supervisor
/// closes it. Returns the exit status.
///
/// Guards installed before anything is loaded (Linux):
///  - the process is killed when its supervisor `supervisor_pid` ends (PR_SET_PDEATHSIG);
///  - no core files, few descriptors; after loading no further processes (seccomp: fork, clone without CLONE_THREAD
///    and exec fail with EPERM), because RLIMIT_NPROC does not apply to root;
///  - for each job the address space may grow by `memory_limit_bytes` of the lease (RLIMIT_AS). If that is not
///    enough, the process exits with kChildOutOfMemory: from operator new, on std::bad_alloc, and on a crash at a null
///    pointer or abort immediately after a failed allocation;
///  - SIGUSR1 asks the running job to stop soon, but only if the supervisor sent it. TERM, INT, HUP and USR2 are
///    blocked (process_guards.h): only the supervisor ends a job.
///
/// Single-threaded. Changes the whole process (signal handlers, new-handler, limits). Call once.
int RunJobProcess(int fd, int supervisor_pid, JobExecutor& executor);

}  // namespace legopt::worker
