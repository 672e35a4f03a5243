#pragma once

#include <csignal>

namespace legopt::worker {

/// What keeps a job process from harming its host and its neighbours; see job_process.h. All act on the calling
/// process and stay.

/// The signals that a job process starts with blocked, and leaves so: TERM, INT, HUP, USR1 and USR2. Batch systems and
/// service managers send them to every process of a job, whatever group or session it is in; what they mean is for the
/// supervisor to decide, which ends its job processes by KILL. Blocked, not ignored: that holds from the first
/// instruction on.
sigset_t SignalsForOthers();

/// Asks the kernel to kill this process when the supervisor dies; exits at once (kChildOrphaned) if it already has.
void DieWithSupervisor(int supervisor_pid);

/// No core files, at most 256 descriptors.
void LimitResources();

/// Makes operator new, and crashes caused by a failed allocation, end the process with kChildOutOfMemory.
void ReportMemoryExhaustion();

/// Denies new processes and other programs from now on; threads stay possible. Returns false where the kernel or the
/// architecture offers no filter (the process group is then the only containment).
bool ForbidNewProcesses();

/// Starts anew with the peak of the resident size, where the kernel allows it.
void ResetPeakMemory();

}  // namespace legopt::worker
