// Policy: a method is parsed strictly from any source, and all its errors are reported at once. Its canonical form,
// and with it its hash, must not change for stored results.

#include "legopt/solvers/methods/method.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "legopt/solvers/penalty_options.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Returns "FIELD: MESSAGE" of all errors, in their order.
template <class Make>
std::vector<std::string> FaultsOf(Make make) {
  std::vector<std::string> faults;
  try {
    make();
  } catch (const InputError& error) {
    for (const InputError::Fault& fault : error.faults()) faults.push_back(fault.field + ": " + fault.message);
  }
  return faults;
}

std::vector<std::string> FaultsOf(const Method& method) {
  return FaultsOf([&] { method.Validate(); });
}

std::vector<std::string> FaultsOfText(const std::string& text) {
  return FaultsOf([&] { Method::FromJson(json::parse(text), "suite.yaml"); });
}

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
  EXPECT_EQ(method.options.As<SqpOptions>().initial_penalty, 1e2);
  EXPECT_EQ(method.options.As<SqpOptions>().max_penalty_iterations, 11);  // up to 1e12
}

TEST(Method, IncrementalVariantsCarryThePapersPrefix) {
  const Method method =
      Method::FromJson(json::parse(R"({"solver": "sqp", "sample_size": 80, "incremental": true})"), "");
  EXPECT_EQ(method.name, "I-SQP");
  EXPECT_TRUE(method.is_stochastic());
  EXPECT_FALSE(Method{}.is_stochastic());
}

TEST(Method, CanonicalFormRoundTrips) {
  const Method method = Method::FromJson(
      json::parse(R"({"solver": "sqp", "name": "mine", "multi_starts": 10, "options": {"trust_box_size": 0.5}})"), "");
  const Method again = Method::FromJson(method.ToJson(), "");
  EXPECT_EQ(again.ToJson(), method.ToJson());
  EXPECT_EQ(again.options.As<SqpOptions>().trust_box_size, 0.5);
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

// The canonical form omits `reference`, so hashes of stored results are unchanged.
TEST(Method, ThePairsOfTheOriginalEvaluatorAreNotWritten) {
  const Method plain = Method::FromJson(json::parse(R"({"solver": "best"})"), "");
  const Method all = Method::FromJson(json::parse(R"({"solver": "best", "options": {"pairs": "all"}})"), "");
  const Method reference =
      Method::FromJson(json::parse(R"({"solver": "best", "options": {"pairs": "reference"}})"), "");
  EXPECT_EQ(plain.pairs, PairSelection::kAll);
  EXPECT_EQ(plain.Hash(), all.Hash());
  EXPECT_EQ(all.ToJson()["options"]["pairs"], "all");
  EXPECT_FALSE(reference.ToJson()["options"].contains("pairs"));
  EXPECT_NE(all.Hash(), reference.Hash());
  EXPECT_EQ(Method::FromCanonical(all.ToJson(), "").Hash(), all.Hash());
  EXPECT_EQ(Method::FromCanonical(reference.ToJson(), "").Hash(), reference.Hash());
  EXPECT_EQ(FaultOf(R"({"solver": "sqp", "options": {"pairs": "some"}})").field, "options.pairs");
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

/// Stored results are found by these hashes; a new option or default changes them on purpose.
TEST(Method, HashesOfTheDefaultsStay) {
  const std::pair<const char*, const char*> hashes[] = {
      {"sqp", "5af88f65e077a8b7521d494cc250c767f816a81cccbcb973d17506ba28f06e5c"},
      {"best", "691bd766255665d8703d0eb62b8c7edd9c8614a8d71d1ef3b71d317922186ec9"},
      {"ipopt", "31b164ae2e17a5fc9ab4e4dae4c94fc9506122592b4914dd296c3fbf858a3f9e"},
      {"sgd", "6ae370174f6af751a3a0136f657ac080ec005a90c12dbd84079afd432fc50ac3"},
      {"adam", "b374f171dbc48eca744ba4094d654ed4ba5992a8083f4000a36fc2df5d6ab89f"},
      {"nadam", "af696f56497310481c9c83d9243bde455e7e3ad2dffbedfd4234776bdb4f3b3f"},
      {"chomp", "cdfd009f6081ca5afab158300fc9c2d5a49034ffc8a10860efa5557e425c0763"},
      {"stomp", "f6149ae4a81c36868292692184aa691f3147b1fa4c3769abc96d657c8eff9749"},
      {"cma_es", "15bcc3c9ae032441c7396ac48ec3d3d3cb146738cee27bbeb2651916a8e04558"},
  };
  for (const auto& [word, hash] : hashes) {
    EXPECT_EQ(Method::FromJson({{"solver", word}, {"options", {{"pairs", "reference"}}}}, "").Hash(), hash) << word;
    Method method = Method::Of(word);
    method.pairs = PairSelection::kReference;
    EXPECT_EQ(method.Hash(), hash) << word;
  }
}

TEST(Method, HashesOfWordsStay) {
  const auto hash = [](const char* text) { return Method::FromJson(json::parse(text), "").Hash(); };
  EXPECT_EQ(hash(R"({"solver": "sqp", "sample_size": 80, "incremental": true, "multi_starts": 10,
                     "options": {"collision": "surface", "continuous_collision": "required", "trust_rule": "measured",
                                 "subproblem": "ipopt", "polish_violations": false, "pairs": "reference"}})"),
            "f8bd1e39b57dcef09aedc29f512c6dcda848e6bd061f1a56325cce2e777e0f28");
  EXPECT_EQ(hash(R"({"solver": "ipopt",
                     "options": {"hessian": "limited_memory", "barrier": "adaptive", "continuous_collision": "none",
                                 "pairs": "reference"}})"),
            "bd8308395b9d39ccbd0401c4ef90aa4c1c07c0da004dd1133f931f1b0891050c");
}

TEST(Method, LaterChoicesLeaveTheHashesOfTheirUsualValue) {
  const auto method = [](const char* stop) {
    return Method::FromJson({{"solver", "sqp"}, {"options", {{"stop_when_feasible", stop}}}}, "");
  };
  EXPECT_EQ(method("incremental").Hash(), Method::Of("sqp").Hash());
  EXPECT_FALSE(method("incremental").ToJson()["options"].contains("stop_when_feasible"));
  EXPECT_NE(method("always").Hash(), method("never").Hash());
  for (const char* stop : {"always", "never"}) {
    EXPECT_NE(method(stop).Hash(), Method::Of("sqp").Hash());
    EXPECT_EQ(Method::FromJson(method(stop).ToJson(), "").Hash(), method(stop).Hash());
  }
  EXPECT_THAT(FaultOf(R"({"solver": "sqp", "options": {"stop_when_feasible": "nevr"}})").fix, HasSubstr("'never'"));
}

TEST(Method, ALaterNumberIsReadBackWhateverTheSolversDefaultIs) {
  for (const char* solver : {"sqp", "best"}) {
    for (const double share : {1.0, 0.95, 0.5}) {
      const Method method =
          Method::FromJson({{"solver", solver}, {"options", {{"subproblem_decrease_share", share}}}}, "");
      const Method again = Method::FromJson(method.ToJson(), "");
      EXPECT_EQ(again.Hash(), method.Hash()) << solver << ' ' << share;
    }
  }
  EXPECT_FALSE(Method::Of("sqp").ToJson()["options"].contains("subproblem_decrease_share"));
}

TEST(Method, TheMemoryOfGradientsIsAChoice) {
  EXPECT_EQ(Method::Of("adam").options.As<MomentGradientOptions>().gradient.memory, GradientMemory::kGradients);
  const Method models = Method::FromJson({{"solver", "adam"}, {"options", {{"memory", "models"}}}}, "");
  EXPECT_EQ(models.options.As<MomentGradientOptions>().gradient.memory, GradientMemory::kModels);
  EXPECT_NE(models.Hash(), Method::Of("adam").Hash());
}

TEST(Method, FormerKeysSayWhatToWriteInstead) {
  for (const char* solver : {"sgd", "adam", "nadam", "chomp", "stomp", "cma_es"}) {
    const json text = {{"solver", solver}, {"options", {{"max_iterations", 700}}}};
    const auto fault = FaultOf(text.dump());
    EXPECT_EQ(fault.field, "options.max_iterations");
    EXPECT_EQ(fault.value, "700");
    EXPECT_EQ(fault.message, "is no option any more");
    EXPECT_THAT(fault.fix, HasSubstr("max_epochs"));
  }
  EXPECT_THAT(FaultsOfText(R"({"solver": "sqp", "options": {"max_iterations": 700}})"), IsEmpty());
  EXPECT_EQ(FaultOf(R"({"solver": "sgd", "options": {"max_iteration": 7}})").message, "unknown key");
}

TEST(Method, AllFaultsOfATextAreTold) {
  EXPECT_THAT(FaultsOfText(R"({"solver": "sgd", "multi_starts": -1, "sample_size": "all", "colour": 1,
                               "options": {"curvature": "steep", "max_trials": 0, "sharpnes": 1, "zeal": 2,
                                           "collision": "solids", "collision_margin_m": 0.05}})"),
              ElementsAre("multi_starts: must be a whole number from 0 to 1000000",
                          "sample_size: must be a whole number from 1 to 100", "options.collision: is not known",
                          "options.curvature: must be a number from 1e-06 to 0.999",
                          "options.max_trials: must be a whole number from 1 to 200", "options.sharpnes: unknown key",
                          "options.zeal: unknown key", "colour: unknown key",
                          "options.contact_range_m: must exceed collision_margin_m"));
  EXPECT_THAT(FaultsOfText(R"({"solver": "spq", "multi_starts": -1, "options": {"anything": 1}, "colour": 1})"),
              ElementsAre("solver: is not known", "multi_starts: must be a whole number from 0 to 1000000",
                          "colour: unknown key"))
      << "whose options these are is not known";
  EXPECT_THAT(FaultsOfText(R"({"solver": "stomp", "sample_size": 80, "incremental": true})"),
              ElementsAre("sample_size: solver stomp uses all terms", "incremental: solver stomp uses all terms"));
}

TEST(Method, EachFaultHasALine) {
  try {
    Method::FromJson({{"solver", "sqp"}, {"multi_starts", -1}, {"incremental", 1}}, "suite.yaml:4");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "suite.yaml:4: multi_starts: must be a whole number from 0 to 1000000 (got '-1')\n"
                 "suite.yaml:4: incremental: must be true or false (got '1')");
  }
}

TEST(Method, AFaultyFieldIsNoReasonToBlameAnother) {
  EXPECT_THAT(FaultsOfText(R"({"solver": "sqp", "options": {"contact_range_m": 7, "collision_margin_m": 0.05}})"),
              ElementsAre("options.contact_range_m: must be a number from 0.001 to 1.0"));
  Method method;
  method.collision_margin_m = std::nan("");
  EXPECT_THAT(FaultsOf(method), ElementsAre("options.collision_margin_m: must be a number from 0.0 to 0.1"));
}

TEST(Method, WhatIsMadeHereIsCheckedLikeAText) {
  EXPECT_THAT(FaultsOf(Method()), IsEmpty());
  for (const SolverEntry& entry : SolverRegistry()) EXPECT_THAT(FaultsOf(Method::Of(entry.word)), IsEmpty());
  Method method;
  method.name = "";
  method.multi_starts = -1;
  method.sample_size_percent = 0;
  method.restart_noise_deg = std::numeric_limits<double>::infinity();
  method.collision = static_cast<SceneRepresentation>(7);
  auto& sqp = method.options.As<SqpOptions>();
  sqp.trust_box_size = std::nan("");
  sqp.trust_rule = static_cast<TrustRule>(2);
  sqp.max_iterations = 0;
  EXPECT_THAT(FaultsOf(method),
              ElementsAre("name: must be a text", "multi_starts: must be a whole number from 0 to 1000000",
                          "sample_size: must be a whole number from 1 to 100",
                          "options.restart_noise_deg: must be a number from 0.0 to 180.0",
                          "options.collision: is no value of the enumeration",
                          "options.trust_box_size: must be a number from 1e-12 to 10.0",
                          "options.max_iterations: must be a whole number from 1 to 100000",
                          "options.trust_rule: is no value of the enumeration"));
  EXPECT_THROW(method.Hash(), InputError);
  EXPECT_THROW(method.ToJson(), InputError);
  EXPECT_THROW(MakeSolver(method), InputError);
}

TEST(Method, ConditionsBetweenFieldsAreCheckedHere) {
  Method method = Method::Of("sgd");
  method.options.As<GradientOptions>().line_search.curvature = 1e-5;
  method.contact_range_m = 1e-3;
  method.collision_margin_m = 2e-3;
  EXPECT_THAT(FaultsOf(method), ElementsAre("options.contact_range_m: must exceed collision_margin_m",
                                            "options.curvature: must exceed sufficient_decrease"));
}

TEST(Method, AnUnknownSolverIsToldWhereOneIsNeeded) {
  Method method;
  method.solver = "spq";
  EXPECT_EQ(method.Hash().size(), 64u);
  EXPECT_THAT(FaultsOf(method), ElementsAre("solver: is not known"));
  EXPECT_THROW(MakeSolver(method), InputError);
  EXPECT_THROW(method.is_stochastic(), InputError);
  EXPECT_THROW(Method::Of("spq"), InputError);
  try {
    MakeSolver(method);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'sqp'"));
  }
}

TEST(Method, OptionsOfAnotherSolverAreRefused) {
  Method method;
  method.solver = "ipopt";
  EXPECT_THAT(FaultsOf(method), ElementsAre("options: are those of another solver than ipopt"));
  EXPECT_THROW(MakeSolver(method), InputError);
}

}  // namespace
}  // namespace legopt
