// The documentation of the protocol agrees with the code: the comment of every request states its number, and that of
// every field that holds an enumeration lists the values defined in legopt/types/.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

#include "bus/message_fields.h"
#include "legopt/types/result.h"
#include "tests/folders.h"

namespace legopt::bus {
namespace {

std::string ReadFile(const std::string& name) {
  std::ifstream file(SourceFolder() + "/lcmtypes/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// Returns the comment of a field of a .lcm file, including continuation lines.
std::string CommentOf(const std::string& message, std::string_view field) {
  std::istringstream file(ReadFile(message + ".lcm"));
  const std::regex declaration(R"(^\s+\w+ )" + std::string(field) + R"((\[\w+\])?;\s*(//.*)?$)");
  const std::regex further(R"(^\s+//.*$)");
  std::string comment;
  bool found = false;
  for (std::string line; std::getline(file, line);) {
    found = found ? std::regex_match(line, further) : std::regex_match(line, declaration);
    if (found && line.find("//") != std::string::npos) comment += line.substr(line.find("//") + 2);
  }
  return std::regex_replace(comment, std::regex(" +"), " ");
}

std::string InPlainWords(std::string_view word) {
  std::string text(word);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

int enumerated_fields = 0;

void ExpectListed(const std::string& /*message*/, std::string_view /*field*/, const fields::AnyValue& /*rule*/) {}
template <class Rule>
void ExpectListed(const std::string& /*message*/, std::string_view /*field*/, const Rule& /*rule*/) {}

template <class Enum>
void ExpectListed(const std::string& message, std::string_view field, const fields::ValueOf<Enum>& /*rule*/) {
  ++enumerated_fields;
  const std::string comment = CommentOf(message, field);
  for (std::size_t i = 0; i < kNumEnumerators<Enum>; ++i) {
    const std::string word = InPlainWords(kEnumNames<Enum>[i].word);
    const bool listed = std::regex_search(comment, std::regex("\\b" + std::to_string(i) + " " + word + "\\b"));
    EXPECT_EQ(listed, word != "unused") << message << "." << field << ": " << i << " " << word << " in:" << comment;
  }
  EXPECT_FALSE(std::regex_search(comment, std::regex("\\b" + std::to_string(kNumEnumerators<Enum>) + " [a-z]")))
      << message << "." << field << ": more values than the enumeration has:" << comment;
}

template <class Enum>
void ExpectListed(const std::string& message, std::string_view field, const fields::EnumNameOf<Enum>& /*rule*/) {
  ++enumerated_fields;
  const std::string comment = CommentOf(message, field);
  for (const EnumName<Enum>& row : kEnumNames<Enum>) {
    EXPECT_NE(comment.find('"' + std::string(row.word) + '"'), std::string::npos)
        << message << "." << field << ": " << row.word << " in:" << comment;
  }
}

template <class Rule>
void ExpectListed(const std::string& message, std::string_view field, const fields::Each<Rule>& rule) {
  ExpectListed(message, field, rule.element);
}

template <class... Message>
void ExpectAllListed(MessageList<Message...> /*all*/) {
  const auto expect = []<class M>(const M* /*type*/) {
    std::apply([](const auto&... field) { (ExpectListed(M::getTypeName(), field.name, field.rule), ...); }, kFields<M>);
  };
  (expect(static_cast<const Message*>(nullptr)), ...);
}

TEST(ProtocolWords, FieldsListTheValuesOfTheirEnumerations) {
  enumerated_fields = 0;
  ExpectAllListed(AllMessages());
  EXPECT_EQ(enumerated_fields, 17);
}

template <class Enum>
void ExpectEveryWordIn(const std::string& text) {
  for (const EnumName<Enum>& row : kEnumNames<Enum>) {
    EXPECT_TRUE(std::regex_search(text, std::regex("\\b" + std::string(row.word) + "\\b"))) << row.word;
  }
}

TEST(ProtocolWords, ResultsListTheWordsOfTheSolverAndReferToTheChecks) {
  const std::string text = ReadFile("result_request.lcm");
  const std::string words = text.substr(0, text.find("struct "));
  ExpectEveryWordIn<SolveStatus>(words);
  EXPECT_NE(words.find("docs/reference/checks.md"), std::string::npos) << "names of verdicts";
}

template <class... Request>
void ExpectNumbersStated(MessageList<Request...> /*all*/) {
  const auto expect = [](MessageType type, const std::string& request) {
    const std::string number = std::to_string(static_cast<int>(type));
    EXPECT_NE(ReadFile(request + ".lcm").find("(type " + number + ", to the server)"), std::string::npos) << request;
  };
  (expect(CallOf<Request>::kType, Request::getTypeName()), ...);
}

TEST(ProtocolWords, EveryRequestStatesItsNumber) { ExpectNumbersStated(Requests()); }

}  // namespace
}  // namespace legopt::bus
