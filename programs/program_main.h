#pragma once

#include <functional>
#include <string>

#include "bus/bus_error.h"
#include "programs/exit_codes.h"
#include "programs/process_start.h"

/// The common part of every `main`.
namespace legopt::programs {

/// Prepares the process (PrepareProcess), runs `body` and returns its exit status. An exception is reported as one line
/// "PROGRAM: error: ..." on standard error and becomes an exit code: bad input kUsage, the network kNetworkUnusable, a
/// file that cannot be used kUsage, no memory, descriptors or processes kMachine, anything else kInternal.
int RunProgram(const std::string& program, ProcessKind kind, const std::function<int()>& body);

/// Reports the exception that is being handled, as RunProgram does; to be called in a catch block.
int ReportException(const std::string& program);

/// Reports why a program ends with `code`, and returns the exit status. If the working directory was removed, that is
/// reported as the cause of what looks like a problem with a file, with kUsage.
int ReportFailure(const std::string& program, ExitCode code, const std::string& message);

/// Why standard output cannot be written: it is closed, a limit on file sizes is reached, or perhaps the disk is full.
std::string OutputFault();

/// Whether the folder that relative paths start from exists no more.
bool WorkingDirectoryWasRemoved();

/// The exit code for an error of the bus.
ExitCode CodeOf(const bus::BusError& error);

}  // namespace legopt::programs
