// Policy: one golden text per table. A change of a table's text is seen in the difference of a file of
// tests/client/golden; LEGOPT_WRITE_GOLDEN=1 writes these files anew.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "command_line_fixture.h"
#include "tests/folders.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

struct Golden {
  std::string name;
  std::vector<std::string> arguments;
};

class GoldenTable : public CommandLine, public testing::WithParamInterface<Golden> {};

TEST_P(GoldenTable, HasTheTextOfItsFile) {
  const std::string database = (folder_.path() / "toy.sqlite").string();
  WriteTestDatabase(database, ToyPool());
  std::vector<std::string> arguments = GetParam().arguments;
  arguments.insert(arguments.end(), {"--db", database});
  const ProgramResult result = Run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;

  const std::string file = SourceFolder() + "/tests/client/golden/" + GetParam().name + ".txt";
  if (std::getenv("LEGOPT_WRITE_GOLDEN") != nullptr) std::ofstream(file) << result.out;
  std::ostringstream golden;
  golden << std::ifstream(file).rdbuf();
  EXPECT_EQ(result.out, golden.str()) << file;
}

INSTANTIATE_TEST_SUITE_P(Tables, GoldenTable,
                         testing::Values(Golden{"table", {"table"}}, Golden{"paper", {"table", "--paper"}},
                                         Golden{"statistics", {"table", "--statistics"}},
                                         Golden{"profile", {"table", "--profile"}}, Golden{"show", {"show", "5"}},
                                         Golden{"jobs", {"list", "1"}}, Golden{"compare", {"compare", "A", "C"}},
                                         Golden{"status", {"status"}},
                                         Golden{"query", {"query", "SELECT * FROM benchmark_table"}}),
                         [](const auto& golden) { return golden.param.name; });

}  // namespace
}  // namespace legopt::client
