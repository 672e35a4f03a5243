#include "app/program_main.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <exception>
#include <filesystem>
#include <ios>
#include <iostream>
#include <new>
#include <system_error>

#include "app/arguments.h"
#include "legopt/files/written_file.h"
#include "legopt/types/input_error.h"

namespace legopt::app {
namespace {

bool MayBeAboutAFile(ExitCode code) {
  return code == ExitCode::kUsage || code == ExitCode::kDatabaseUnusable || code == ExitCode::kMachine ||
         code == ExitCode::kInternal;
}

std::string PlaceOf(const std::filesystem::filesystem_error& error) {
  std::string place = error.path1().string();
  if (!error.path2().empty()) place += " and " + error.path2().string();
  return place.empty() ? "file system" : place;
}

int ReportInput(const std::string& program, const InputError& error) {
  if (WorkingDirectoryWasRemoved()) return ReportFailure(program, ExitCode::kUsage, error.what());
  ReportError(program, error);
  return StatusOf(ExitCode::kUsage);
}

// Reports that standard output cannot be written. No other stream throws.
int ReportOutputFailure(const std::string& program) {
  RequireReader(STDOUT_FILENO);
  return ReportFailure(program, ExitCode::kUsage, OutputFault());
}

// Ends the process as if it had not ignored SIGPIPE.
void RaiseSigpipe() {
  ::signal(SIGPIPE, SIG_DFL);
  UnblockSignals();
  ::raise(SIGPIPE);
}

int ReportRefusal(const std::string& program, const std::filesystem::filesystem_error& error) {
  const bool shortage = files::IsShortage(error.code().value());
  return ReportFailure(program, shortage ? ExitCode::kMachine : ExitCode::kUsage,
                       PlaceOf(error) + ": " + files::Explain(error.code().value()));
}

}  // namespace

bool WorkingDirectoryWasRemoved() {
  std::array<char, PATH_MAX> folder{};
  return ::getcwd(folder.data(), folder.size()) == nullptr && errno == ENOENT;
}

std::string OutputFault() {
  const std::string start = "standard output cannot be written; ";
  const int flags = ::fcntl(STDOUT_FILENO, F_GETFL);
  // PrepareProcess opens a closed one for reading.
  if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) return start + "it is closed: send it to a file or to /dev/null";
  struct stat status {};
  rlimit size{};
  const bool known = ::fstat(STDOUT_FILENO, &status) == 0 && ::getrlimit(RLIMIT_FSIZE, &size) == 0;
  if (known && S_ISREG(status.st_mode) && static_cast<rlim_t>(status.st_size) >= size.rlim_cur) {
    return start + files::Explain(EFBIG);
  }
  return start + "is the disk full?";
}

ExitCode CodeOf(const bus::BusError& error) {
  switch (error.code()) {
    case bus::BusErrorCode::kInvalidOption:
    case bus::BusErrorCode::kInvalidMessage:  // caused by the user's request; the error names field and range
      return ExitCode::kUsage;
    default:
      return ExitCode::kNetworkUnusable;
  }
}

int ReportFailure(const std::string& program, ExitCode code, const std::string& message) {
  if (MayBeAboutAFile(code) && WorkingDirectoryWasRemoved()) {
    ReportError(program, "the working directory was removed; change to one that exists (" + message + ")");
    return StatusOf(ExitCode::kUsage);
  }
  ReportError(program, message);
  return StatusOf(code);
}

void RequireReader(int descriptor) {
  pollfd state{descriptor, POLLOUT, 0};
  if (::poll(&state, 1, 0) == 1 && (state.revents & POLLERR) != 0) throw ReaderGone();
}

namespace {

int ReportUnlessReaderGone(const std::string& program) {
  try {
    throw;
  } catch (const InputError& error) {
    return ReportInput(program, error);
  } catch (const bus::BusError& error) {
    return ReportFailure(program, CodeOf(error), error.what());
  } catch (const ReaderGone&) {
    throw;
  } catch (const std::ios_base::failure&) {
    return ReportOutputFailure(program);
  } catch (const files::FileError& error) {
    if (error.error() == EPIPE) throw ReaderGone();
    return ReportFailure(program, error.shortage() ? ExitCode::kMachine : ExitCode::kUsage, error.what());
  } catch (const std::bad_alloc&) {
    return ReportFailure(program, ExitCode::kMachine, "out of memory; give the program more, or less to do");
  } catch (const std::filesystem::filesystem_error& error) {
    return ReportRefusal(program, error);
  } catch (const std::system_error& error) {
    // Also thrown for threads, if there is no memory for their stacks.
    const bool no_process = error.code() == std::errc::resource_unavailable_try_again;
    return ReportFailure(program, ExitCode::kMachine,
                         std::string("the system refuses: ") + error.what() +
                             (no_process ? "; end other programs, or raise 'ulimit -u' or 'ulimit -v'" : ""));
  } catch (const std::exception& error) {
    return ReportFailure(program, ExitCode::kInternal,
                         std::string("internal error: ") + error.what() + "; please report it");
  } catch (...) {
    return ReportFailure(program, ExitCode::kInternal, "internal error of an unknown kind; please report it");
  }
}

}  // namespace

int ReportException(const std::string& program) {
  std::cout.exceptions(std::ios_base::goodbit);  // the report itself must not throw
  try {
    return ReportUnlessReaderGone(program);
  } catch (const ReaderGone&) {
    return kReaderGoneStatus;
  }
}

namespace {

int RunBody(const std::string& program, ProcessKind kind, const std::function<int()>& body) {
  try {
    PrepareProcess(kind);
    if (kind == ProcessKind::kCommand) std::cout.exceptions(std::ios_base::badbit);
    return body();
  } catch (...) {
    return ReportException(program);
  }
}

}  // namespace

int RunProgram(const std::string& program, ProcessKind kind, const std::function<int()>& body) {
  const int status = RunBody(program, kind, body);
  if (status == kReaderGoneStatus) RaiseSigpipe();
  return status;
}

}  // namespace legopt::app
