#include "legopt/methods/method.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "legopt/input_error.h"

namespace legopt {
namespace {

using nlohmann::json;

InputError::Fault FaultOf(const std::string& text) {
  try {
    Method::FromJson(json::parse(text), "suite.yaml");
  } catch (const InputError& error) {
    return error.fault();
  }
  ADD_FAILURE() << "accepted: " << text;
  return {};
}

TEST(Method, DefaultsAreThePapers) {
  const Method method = Method::FromJson(json::parse(R"({"solver": "sqp"})"), "");
  EXPECT_EQ(method.name, "SQP");
  EXPECT_EQ(method.multi_starts, 0);
  EXPECT_EQ(std::get<SqpOptions>(method.options).initial_penalty, 1e2);
  EXPECT_EQ(std::get<SqpOptions>(method.options).max_penalty_iterations, 11);  // up to 1e12
}

TEST(Method, IncrementalVariantsCarryThePapersPrefix) {
  const Method method =
      Method::FromJson(json::parse(R"({"solver": "sqp", "sample_size": 80, "incremental": true})"), "");
  EXPECT_EQ(method.name, "I-SQP");
  EXPECT_TRUE(method.draws());
  EXPECT_FALSE(Method{}.draws());
}

TEST(Method, CanonicalFormRoundTrips) {
  const Method method = Method::FromJson(
      json::parse(R"({"solver": "sqp", "name": "mine", "multi_starts": 10, "options": {"trust_box_size": 0.5}})"), "");
  const Method again = Method::FromJson(method.ToJson(), "");
  EXPECT_EQ(again.ToJson(), method.ToJson());
  EXPECT_EQ(std::get<SqpOptions>(again.options).trust_box_size, 0.5);
  EXPECT_EQ(again.Hash(), method.Hash());
}

TEST(Method, HashIgnoresTheNameOnly) {
  const Method plain = Method::FromJson(json::parse(R"({"solver": "sqp"})"), "");
  const Method named = Method::FromJson(json::parse(R"({"solver": "sqp", "name": "other"})"), "");
  const Method spelled = Method::FromJson(json::parse(R"({"solver": "sqp", "options": {"trust_box_size": 0.1}})"), "");
  const Method different =
      Method::FromJson(json::parse(R"({"solver": "sqp", "options": {"trust_box_size": 0.2}})"), "");
  EXPECT_EQ(plain.Hash().size(), 64u);
  EXPECT_EQ(plain.Hash(), named.Hash());
  EXPECT_EQ(plain.Hash(), spelled.Hash());
  EXPECT_NE(plain.Hash(), different.Hash());
}

TEST(Method, UnknownKeysNameTheNearest) {
  const auto top = FaultOf(R"({"solver": "sqp", "multistarts": 3})");
  EXPECT_EQ(top.field, "multistarts");
  EXPECT_NE(top.fix.find("multi_starts"), std::string::npos);
  const auto option = FaultOf(R"({"solver": "sqp", "options": {"trust_box": 1}})");
  EXPECT_EQ(option.field, "options.trust_box");
  EXPECT_NE(option.fix.find("trust_box_size"), std::string::npos);
  EXPECT_NE(FaultOf(R"({"solver": "spq"})").fix.find("sqp"), std::string::npos);
}

TEST(Method, WrongTypesAndRanges) {
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "multi_starts": -1})").field, "multi_starts");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "multi_starts": 1.5})").field, "multi_starts");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "incremental": "no"})").field, "incremental");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": 3})").field, "options");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": {"trust_box_size": "wide"}})").field, "options.trust_box_size");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": {"trust_box_size": 1e-5}})").field, "options.trust_box_size");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": {"constraint_tolerance": 0.1}})").field,
            "options.constraint_tolerance");
  EXPECT_EQ(FaultOf(R"({"name": "x"})").field, "solver");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "sample_size": 0})").field, "sample_size");
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": {"collision": "solids"}})").field, "options.collision");
}

}  // namespace
}  // namespace legopt
