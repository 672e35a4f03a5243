#pragma once

#include "worker/job_executor.h"

namespace legopt::worker {

/// The body of a job process: loads the executor's datasets, then runs jobs that arrive on `fd` until the supervisor
/// closes it. Returns the exit status.
///
/// Guards set up before anything is loaded (Linux):
///  - the process dies with its supervisor `supervisor_pid` (PR_SET_PDEATHSIG), whatever it is doing;
///  - no core files, few descriptors; after loading no further processes (seccomp: fork, clone without CLONE_THREAD
///    and exec fail with EPERM), since RLIMIT_NPROC does not bind root;
///  - per job the address space may grow by `memory_limit_bytes` of the lease (RLIMIT_AS); when that is not enough the
///    process exits with kChildOutOfMemory: from operator new, on std::bad_alloc, and on a crash at a null pointer or
///    abort right after an allocation had failed;
///  - SIGUSR1 of the supervisor, and of nobody else, asks the running job to stop soon; TERM, INT, HUP and USR2 are
///    blocked (process_guards.h): only the supervisor ends a job.
///
/// Single-threaded; takes over the process (signal handlers, new-handler, limits). Call once.
int RunJobProcess(int fd, int supervisor_pid, JobExecutor& executor);

}  // namespace legopt::worker
