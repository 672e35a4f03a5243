// Policy: every message of lcmtypes/ is shown completely with the names of its .lcm file, and the output determines
// the same bytes again.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "bus/codec.h"
#include "bus/message_fields.h"
#include "client/tap/captured_datagram.h"
#include "tests/bus/sample_messages.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

using Names = std::vector<std::string>;

template <class Message>
Names ListedFields() {
  Names names;
  std::apply([&](const auto&... field) { (names.emplace_back(field.name), ...); }, bus::kFields<Message>);
  return names;
}

template <class... Message>
std::map<std::string, Names> ListedMessages(bus::MessageList<Message...> /*all*/) {
  return {{Message::getTypeName(), ListedFields<Message>()}...};
}

Names FieldsOfFile(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  std::string code = std::regex_replace(text.str(), std::regex("//[^\n]*"), "");
  code = code.substr(code.find('{'));
  Names names;
  const std::regex field(R"(\w+\s+(\w+)(\[\w+\])?\s*;)");
  for (auto at = std::sregex_iterator(code.begin(), code.end(), field); at != std::sregex_iterator(); ++at) {
    names.push_back((*at)[1]);
  }
  return names;
}

TEST(MessageFields, EveryFileIsListedWithItsFieldsInOrder) {
  const auto listed = ListedMessages(bus::AllMessages());
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(SourceFolder() + "/lcmtypes")) {
    if (entry.path().extension() != ".lcm") continue;
    const std::string name = entry.path().stem().string();
    files.insert(name);
    ASSERT_TRUE(listed.contains(name)) << name << ": add it to lcmtypes/messages.def";
    EXPECT_EQ(listed.at(name), FieldsOfFile(entry.path())) << name;
  }
  EXPECT_EQ(files.size(), listed.size());
}

// Inverse conversion, for the test only.
template <class Message>
void FromJson(const Json& json, Message* message);
template <class Number>
requires std::is_arithmetic_v<Number>
void ValueFromJson(const Json& json, Number* value) {
  *value = json.is_null() ? static_cast<Number>(std::nan("")) : json.get<Number>();
}
void ValueFromJson(const Json& json, std::string* value) { *value = json.get<std::string>(); }
template <class Nested>
requires std::is_class_v<Nested>
void ValueFromJson(const Json& json, Nested* value) { FromJson(json, value); }
template <class Value>
void ValueFromJson(const Json& json, std::vector<Value>* values) {
  for (const Json& item : json) ValueFromJson(item, &values->emplace_back());
}
template <class Message>
void FromJson(const Json& json, Message* message) {
  std::apply(
      [&](const auto&... field) {
        (ValueFromJson(json.at(std::string(field.name)), &(message->*field.member)), ...);
        EXPECT_EQ(json.size(), sizeof...(field)) << json;
      },
      bus::kFields<Message>);
}

template <class Message>
void ExpectShownWhole(bus::MessageType type, bool of_reply) {
  const std::string bytes = bus::Encode(bus::Sample<Message>());
  std::string why;
  const auto shown = BodyToJson(type, of_reply, bytes, &why);
  ASSERT_TRUE(shown.has_value()) << why;
  Message again{};
  FromJson(Json::parse(shown->dump()), &again);
  EXPECT_EQ(bus::Encode(again), bytes) << *shown;
  // Bytes of another message are not accepted as this one.
  EXPECT_FALSE(BodyToJson(type, !of_reply, bytes, &why).has_value());
  EXPECT_NE(why, "");
}

template <class... Request>
void ExpectEveryCallShown(bus::MessageList<Request...> /*all*/) {
  (ExpectShownWhole<Request>(bus::CallOf<Request>::kType, false), ...);
  (ExpectShownWhole<typename bus::CallOf<Request>::Reply>(bus::CallOf<Request>::kType, true), ...);
}

TEST(MessageJson, EveryCallIsShownWhole) { ExpectEveryCallShown(bus::Requests()); }

TEST(MessageJson, FiguresThatAreNotAvailableAreNull) {
  auto result = bus::Sample<legopt_msg::result_request>();
  result.cost = std::nan("");
  const auto shown = BodyToJson(bus::MessageType::kResult, false, bus::Encode(result), nullptr);
  ASSERT_TRUE(shown.has_value());
  EXPECT_TRUE(Json::parse(shown->dump()).at("cost").is_null());
}

TEST(MessageJson, SixtyFourBitsAreExact) {
  legopt_msg::probe_request request{};
  request.nonce = INT64_MIN + 1;
  const auto shown = BodyToJson(bus::MessageType::kProbe, false, bus::Encode(request), nullptr);
  EXPECT_EQ(shown->dump(), R"({"nonce":-9223372036854775807})");
}

TEST(MessageJson, WhatIsNoMessageIsRefusedWithAReason) {
  std::string why;
  EXPECT_FALSE(BodyToJson(bus::MessageType::kLease, false, "nonsense", &why).has_value());
  EXPECT_NE(why.find("lease_request"), std::string::npos) << why;
  for (const int type : {-1, 0, bus::kLastMessageType + 1, 32767}) {
    EXPECT_FALSE(BodyToJson(static_cast<bus::MessageType>(type), false, "", &why).has_value());
    EXPECT_EQ(why, "no such message type");
  }
}

}  // namespace
}  // namespace legopt::client
