// Policy: each exception that may leave a program's body is mapped to its exit code and one line. A removed working
// directory is reported as the cause of file errors that result from it.

#include "app/program_main.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include "app/isolated_call.h"
#include "legopt/files/written_file.h"
#include "legopt/types/input_error.h"
#include "tests/temporary_folder.h"

namespace legopt::app {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Returns "CODE LINE" of a program whose body throws.
std::string EndOf(const std::function<void()>& body) {
  return CallIsolated(
      [&body] {
        ::testing::internal::CaptureStderr();
        const int code = RunProgram("program", ProcessKind::kCommand, [&body] {
          body();
          return 0;
        });
        return std::to_string(code) + " " + ::testing::internal::GetCapturedStderr();
      },
      {});
}

TEST(ProgramMain, ExceptionsBecomeExitCodes) {
  EXPECT_EQ(EndOf([] {}), "0 ");
  EXPECT_THAT(EndOf([] {
                throw InputError({"suite.yaml", "", "", "is empty", ""});
              }),
              StartsWith("2 program: error: suite.yaml: is empty"));
  EXPECT_THAT(EndOf([] { throw bus::BusError(bus::BusErrorCode::kNoMulticastRoute, "no route"); }), StartsWith("7 "));
  EXPECT_THAT(EndOf([] { throw files::FileError("a", "cannot be written", ENOSPC); }),
              StartsWith("2 program: error: a:"));
  EXPECT_THAT(EndOf([] { throw std::bad_alloc(); }), StartsWith("71 program: error: out of memory"));
  EXPECT_THAT(EndOf([] { throw std::system_error(EAGAIN, std::generic_category(), "fork"); }), StartsWith("71 "));
  EXPECT_THAT(EndOf([] { throw std::runtime_error("odd"); }), StartsWith("70 program: error: internal error: odd"));
  EXPECT_THAT(EndOf([] { throw 42; }), StartsWith("70 "));
}

TEST(ProgramMain, ShortagesAreTheMachinesWhateverMetThem) {
  for (const int error : {EMFILE, ENFILE, ENOMEM}) {
    EXPECT_THAT(EndOf([error] { throw files::FileError("a", "cannot be written", error); }), StartsWith("71 "));
    EXPECT_THAT(EndOf([error] {
                  throw std::filesystem::filesystem_error("open", "a", std::error_code(error, std::generic_category()));
                }),
                StartsWith("71 "));
  }
  EXPECT_THAT(EndOf([] {
                throw std::filesystem::filesystem_error("open", "a", std::error_code(EACCES, std::generic_category()));
              }),
              StartsWith("2 program: error: a: Permission denied"));
}

class SaysWhenDestroyed {
 public:
  ~SaysWhenDestroyed() { std::fputs("destroyed", stderr); }
};

TEST(ProgramMainDeathTest, AClosedPipeRunsDestructorsAndEndsAsItsSignalDoes) {
  const auto run = [](const std::function<void()>& write) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0 || ::dup2(ends[1], STDOUT_FILENO) < 0) std::abort();
    for (const int end : ends) ::close(end);
    RunProgram("program", ProcessKind::kCommand, [&write] {
      const SaysWhenDestroyed object;
      write();
      return 0;
    });
  };
  const std::function<void()> writes[] = {
      [] { std::cout << "text" << std::flush; },
      [] { throw files::FileError("/dev/stdout", "cannot be written", EPIPE); },
      [] { RequireReader(STDOUT_FILENO); },
      [] { std::cout << std::string(100'000, 'x'); },
  };
  for (const auto& write : writes) EXPECT_EXIT(run(write), ::testing::KilledBySignal(SIGPIPE), "^destroyed$");
}

TEST(ProgramMain, AnOutputWithReaderIsAccepted) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  EXPECT_NO_THROW(RequireReader(ends[1]));
  ::close(ends[0]);
  EXPECT_THROW(RequireReader(ends[1]), ReaderGone);
  ::close(ends[1]);
}

TEST(ProgramMain, ARemovedWorkingDirectoryIsTheCause) {
  const test::TemporaryFolder folder;
  const std::filesystem::path gone = folder / "gone";
  const std::string end = EndOf([&gone] {
    std::filesystem::create_directory(gone);
    ASSERT_EQ(::chdir(gone.c_str()), 0);
    std::filesystem::remove(gone);
    std::filesystem::path("relative") = std::filesystem::absolute("relative");
  });
  EXPECT_THAT(end, StartsWith("2 program: error: the working directory was removed"));
}

}  // namespace
}  // namespace legopt::app
