#pragma once

#include <csignal>

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

}  // namespace legopt::worker
