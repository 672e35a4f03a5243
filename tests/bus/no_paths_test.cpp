// No message names a path to open or a command to run. Every text field of a message is listed here with its use; a
// new field fails this test until it is reviewed and listed.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "tests/folders.h"

namespace {

// Uses of a text field. None of them opens or runs anything:
// shown      printed or stored for humans
// compared   looked up among known names, as a hash or an identity
// word       one of a fixed set; any other value is refused
// json       parsed by fixed keys: server/spec.cpp, the methods' option readers, listings
// sql        one statement on a read-only connection that can neither attach nor load
//            (tests/db/read_only_database_test)
const std::map<std::string, std::string> kTexts = {
    {"cancel_reply.message", "shown"},
    {"capability.kind", "word"},
    {"capability.name", "compared"},
    {"capability.hash", "compared"},
    {"control_reply.message", "shown"},
    {"control_request.reason", "shown"},
    {"dataset_request.hash", "compared"},
    {"hello_reply.message", "shown"},
    {"hello_request.worker_name", "shown"},
    {"hello_request.hostname", "shown"},
    {"hello_request.build", "shown"},
    {"hello_request.build_id", "compared"},
    {"hello_request.processor", "shown"},
    {"lease.dataset_hash", "compared"},
    {"lease.method_hash", "compared"},
    {"lease.task", "word"},
    {"lease.initialization", "word"},
    {"lease_reply.message", "shown"},
    {"lease_reply.wanted_dataset", "compared"},
    {"method_reply.options_json", "json"},
    {"method_request.hash", "compared"},
    {"probe_reply.server_version", "shown"},
    {"probe_reply.hostname", "shown"},
    {"probe_reply.database", "shown"},  // location of the server's database for its operator; clients never open it
    {"query_reply.message", "shown"},
    {"query_reply.json", "json"},
    {"query_request.sql", "sql"},
    {"result_reply.message", "shown"},
    {"result_request.message", "shown"},
    {"result_request.log_tail", "shown"},
    {"result_request.solver_status", "word"},
    {"result_request.verdict_literal", "word"},
    {"result_request.verdict_strict", "word"},
    {"result_request.verdict_solid", "word"},
    {"result_request.verdict_physical", "word"},
    {"result_request.verdict_detail", "shown"},
    {"result_request.window_verdict", "word"},
    {"status_reply.json", "json"},
    {"store_dataset_reply.message", "shown"},
    {"store_dataset_request.hash", "compared"},
    {"submit_reply.message", "shown"},
    {"submit_request.submission_id", "compared"},
    {"submit_request.spec_json", "json"},
    {"violation.check", "word"},
    {"violation.rule", "word"},
    {"violation.subject", "shown"},
};

TEST(NoPaths, EveryTextOfEveryMessageIsAccountedFor) {
  std::set<std::string> found;
  const std::regex field(R"(^\s*string\s+(\w+))");
  for (const auto& entry : std::filesystem::directory_iterator(legopt::SourceFolder() + "/lcmtypes")) {
    if (entry.path().extension() != ".lcm") continue;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) {
      std::smatch match;
      if (std::regex_search(line, match, field)) found.insert(entry.path().stem().string() + "." + match[1].str());
    }
  }
  for (const std::string& text : found) EXPECT_TRUE(kTexts.contains(text)) << text << ": what is it for?";
  for (const auto& [text, use] : kTexts) EXPECT_TRUE(found.contains(text)) << text << " is gone";
}

// Calls that open a file by name or start a program occur only where the name comes from the command line or this
// machine.
TEST(NoPaths, MessageHandlersOpenAndRunNothing) {
  const std::regex opens(
      R"(\b(fopen|ofstream|ifstream|fstream|NewFile|ReplaceFile|ClaimName|system|popen|execv\w*|execl\w*|posix_spawn\w*|dlopen)\b)");
  for (const char* room : {"bus", "server"}) {
    for (const auto& entry : std::filesystem::directory_iterator(legopt::SourceFolder() + "/" + std::string(room))) {
      if (entry.path().extension() != ".cpp") continue;
      // It opens only /proc and /sys, by constant names.
      if (entry.path().filename() == "udp_socket.cpp") continue;
      std::ifstream file(entry.path());
      int number = 0;
      for (std::string line; std::getline(file, line);) {
        ++number;
        EXPECT_FALSE(std::regex_search(line, opens)) << entry.path() << ":" << number << ": " << line;
      }
    }
  }
}

}  // namespace
