#pragma once

#include <exception>
#include <functional>
#include <string>

#include "app/exit_codes.h"
#include "app/processes.h"
#include "bus/bus_error.h"

/// Common part of every `main`.
namespace legopt::app {

/// Exception: the reader of this process's output, e.g. `head`, has closed the pipe. Ends the program without a
/// message.
class ReaderGone : public std::exception {
 public:
  const char* what() const noexcept override { return "the reader of the output has closed it"; }
};

/// Exit status of a program whose reader has gone: that with which shells report SIGPIPE.
inline constexpr int kReaderGoneStatus = 141;

/// Throws ReaderGone if `descriptor` is a pipe or socket whose reading end is closed.
void RequireReader(int descriptor);

/// Prepares the process (PrepareProcess), runs `body` and returns its exit status. An exception is printed as one line
/// "PROGRAM: error: ..." to standard error and converted to an exit code: invalid input kUsage, the network
/// kNetworkUnusable, an unusable file kUsage, no memory, descriptors or processes kMachine, anything else kInternal.
///
/// A command's std::cout throws when it cannot be written. If the reader has gone, all destructors run, so that no
/// files and processes are left behind, and then SIGPIPE ends the process. Any other failure is an error (kUsage).
int RunProgram(const std::string& program, ProcessKind kind, const std::function<int()>& body);

/// Reports the exception being handled, as RunProgram does. Must be called in a catch block.
int ReportException(const std::string& program);

/// Prints why a program ends with `code`, and returns the exit status. If the working directory was removed, this is
/// reported as the cause of an apparent problem with a file, with kUsage.
int ReportFailure(const std::string& program, ExitCode code, const std::string& message);

/// Returns the reason why standard output cannot be written: it is closed, a limit on file sizes is reached, or perhaps
/// the disk is full.
std::string OutputFault();

/// Whether the working directory, from which relative paths start, no longer exists.
bool WorkingDirectoryWasRemoved();

/// Returns the exit code for an error of the bus.
ExitCode CodeOf(const bus::BusError& error);

}  // namespace legopt::app
