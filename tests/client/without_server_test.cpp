// Policy: without a server, every command that needs one reports this with the likely causes and its own exit code.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "command_line_fixture.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

// Runs commands that call a server, on unused ports without one.
class WithoutServer : public CommandLine {
 protected:
  void SetUp() override {
    try {
      port_ = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
    } catch (const bus::BusError& error) {
      GTEST_SKIP() << error.what();
    }
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
  }
  std::string port_;
};

TEST_F(WithoutServer, EveryCommandSaysSo) {
  const std::vector<std::vector<std::string>> commands = {
      {"status"},         {"list"}, {"table"}, {"watch"}, {"show", "1"}, {"cancel", "1"}, {"query", "SELECT 1"},
      {"submit", "quick"}};
  for (auto command : commands) {
    command.insert(command.end(), {"--port", port_, "--timeout", "0.2"});
    ExpectError(Run(command), 3, "no legopt-server answers at 239.255.76.67:" + port_);
  }
}

// The most likely cause comes first: with a key, that it differs from the server's.
TEST_F(WithoutServer, AKeyIsSuspectedFirst) {
  ASSERT_EQ(Run({"service", "keygen", "lab.key"}).exit_code, 0);
  const auto key = (folder_.path() / "lab.key").string();
  ExpectError(Run({"status", "--port", port_, "--timeout", "0.2", "--key-file", key}), 3,
              ":" + port_ + "; does it have the same key as we have in " + key + "? Else start one");
  ExpectError(Run({"status", "--port", port_, "--timeout", "0.2"}, {{"LEGOPT_KEY_FILE", ""}}), 3,
              "A server that has a key answers only who has it");
}

TEST_F(WithoutServer, PortMayComeFromTheEnvironment) {
  ExpectError(Run({"status", "--timeout", "0.2"}, {{"LEGOPT_PORT", port_}}), 3, port_);
}

TEST_F(WithoutServer, BadAddressIsAUsageError) {
  ExpectError(Run({"status", "--group", "10.0.0.1"}), 2, "10.0.0.1");
  ExpectError(Run({"status", "--port", "99"}), 2, "99");
}

TEST_F(WithoutServer, DoctorWarnsButDoesNotFail) {
  const auto result = Run({"service", "doctor", "--port", port_, "--timeout", "0.2", "--format", "json"});
  const auto findings = nlohmann::json::parse(result.out);
  bool server_seen = false;
  for (const auto& finding : findings) {
    if (finding.at("check") == "server") {
      server_seen = true;
      EXPECT_EQ(finding.at("state"), "warn");
      EXPECT_NE(finding.at("fix"), "");
    }
    const bool must_be_ok = finding.at("check") == "dataset" || finding.at("check") == "multicast route";
    EXPECT_TRUE(!must_be_ok || finding.at("state") == "ok") << finding;
  }
  EXPECT_TRUE(server_seen);
}

TEST_F(WithoutServer, DoctorReportsThatItCouldNotCheckADatabase) {
  const std::string database = Database();
  for (const char* folder : {"/nonexistent", "/proc"}) {
    const auto result =
        Run({"service", "doctor", "--port", port_, "--timeout", "0.2", "--db", database}, {{"TMPDIR", folder}});
    EXPECT_EQ(result.exit_code, kUsage) << result.err;
    EXPECT_THAT(result.out, HasSubstr("test.sqlite: not checked"));
    EXPECT_THAT(result.out, HasSubstr(folder));
    EXPECT_THAT(result.out, HasSubstr("set TMPDIR to another folder"));
  }
}

TEST_F(WithoutServer, ARunWithoutAFolderForTemporaryFilesNamesTmpdir) {
  const auto result = Run({"run", "quick", "--workers", "1"}, {{"TMPDIR", "/nonexistent"}});
  ExpectError(result, kUsage, "/nonexistent: cannot be the folder for temporary files (TMPDIR)");
}

TEST_F(WithoutServer, DoctorFailsForABadDataset) {
  const auto result = Run({"service", "doctor", "--port", port_, "--timeout", "0.2", "--dataset", "/nowhere"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("fail"));
}

}  // namespace
}  // namespace legopt::client
