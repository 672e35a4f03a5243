// Policy: `legopt serve` as a user runs it. It prints its address, serves until stopped, and refuses with an exit
// code.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "command_line_fixture.h"
#include "tests/client/raw_http.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class ServeCommand : public CommandLine {
 protected:
  std::string file_ = Database();
};

TEST_F(ServeCommand, ServesUntilItIsInterrupted) {
  RunningProgram program(BuiltProgram("legopt"), {"serve", "--db", file_, "--http-port", "0"}, folder_.path());
  std::string url;
  ASSERT_TRUE(program.WaitForOutput([&](const std::string& out) {
    url = out.substr(0, out.find('\n'));
    return out.find('\n') != std::string::npos;
  }));
  ASSERT_THAT(url, HasSubstr("http://127.0.0.1:"));
  const std::uint16_t port = test::PortOf(url);
  EXPECT_THAT(test::Fetch(port, "/"), HasSubstr("page.js"));
  EXPECT_THAT(test::Fetch(port, "/state"), HasSubstr("\"jobs\":2"));
  EXPECT_THAT(test::Fetch(port, "/healthz"), testing::AllOf(HasSubstr("200 OK"), HasSubstr("\r\n\r\nok")));
  EXPECT_THAT(test::Fetch(port, "/metrics"),
              testing::AllOf(HasSubstr("version=0.0.4"), HasSubstr("legopt_jobs{state=")));
  test::RawHttp stream(port);
  stream.Get("/events");
  EXPECT_THAT(stream.Receive("\"jobs\":2"), HasSubstr("data: {"));
  ExpectError(Run({"serve", "--db", file_, "--http-port", std::to_string(port)}), 7, "choose another with --http-port");
  kill(program.pid(), SIGINT);
  EXPECT_EQ(program.Wait().exit_code, 0);
  EXPECT_TRUE(stream.Closed());
}

TEST_F(ServeCommand, RefusesWhatItCannotServe) {
  ExpectError(Run({"serve", "--db", (folder_.path() / "none.sqlite").string()}), 6, "none.sqlite");
  ExpectError(Run({"serve", "--db", file_, "--http-address", "nowhere", "--http-port", "0"}), 2, "'nowhere'");
  ExpectError(Run({"serve", "--db", file_, "--http-port", "70000"}), 2, "--http-port");
  ExpectError(Run({"serve", "--db", file_, "--methods", "none"}), 2, "--methods");
  ExpectError(Run({"serve", "--db", file_, "--dataset", (folder_.path() / "gone").string()}), 2, "gone");
}

}  // namespace
}  // namespace legopt::client
