#pragma once

#include <csignal>

#include "worker/job_executor.h"

namespace legopt::worker {

/// Guards that keep a job process from harming its host and other processes; see job_process.h. All of them affect the
/// calling process permanently.

/// Signals that a job process blocks from its start: TERM, INT, HUP, USR1 and USR2. Batch systems and service managers
/// send them to every process of a job, regardless of its process group or session. The supervisor reacts to them and
/// ends its job processes with KILL. The signals are blocked, not ignored, so that this holds from the first
/// instruction on.
sigset_t SupervisorSignals();

/// Asks the kernel to kill this process when the supervisor ends. Exits immediately (kChildOrphaned) if it has already
/// ended.
void DieWithSupervisor(int supervisor_pid);

/// Disables core files and limits descriptors to 256.
void LimitResources();

/// Makes operator new, and crashes caused by a failed allocation, end the process with kChildOutOfMemory.
void ReportMemoryExhaustion();

/// Denies new processes and other programs from now on; threads stay possible. Returns false if the kernel or the
/// architecture has no such filter (the process group is then the only containment).
bool ForbidNewProcesses();

/// Resets the peak of the resident size, if the kernel permits it.
void ResetPeakMemory();

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
///    blocked (job_process.h): only the supervisor ends a job.
///
/// Single-threaded. Changes the whole process (signal handlers, new-handler, limits). Call once.
int RunJobProcess(int fd, int supervisor_pid, JobExecutor& executor);

}  // namespace legopt::worker
