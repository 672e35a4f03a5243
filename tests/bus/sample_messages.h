// One legal message of every type with every field set and every array filled, generated from the messages' rules
// (bus/message_fields.h). Each field gets a value that its rule allows and that differs from its neighbours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "bus/message_fields.h"
#include "bus/message_validation.h"
#include "bus/messages.h"

namespace legopt::bus {

template <class Message>
Message Sample();

namespace sample_internal {

// Adjusts values that depend on each other, which the rules of single fields do not express.
template <class Message>
void Agree(Message& /*message*/) {}
void Agree(legopt_msg::capability& message);
void Agree(legopt_msg::chunk& message);
void Agree(legopt_msg::lease_reply& message);
void Agree(legopt_msg::lease_state& message);
void Agree(legopt_msg::result_request& message);
void Agree(legopt_msg::control_request& message);

// Chooses the values of a message's fields by their rules, beginning with field number 1.
template <class Message>
struct Sampler {
  const Message& message;  // filled so far; limits may depend on other fields
  std::string_view name;
  int number = 0;

  std::int64_t Within(std::int64_t low, std::int64_t high) const { return high - low < number ? high : low + number; }
  std::string Named(std::int64_t most) const {
    return CleanText(std::string(name) + " \xC3\xBC", static_cast<std::size_t>(most));
  }

  template <class Value>
  Value Of(const fields::AnyValue& /*rule*/, Value* /*type*/) const {
    return static_cast<Value>(-number);
  }
  template <class Low, class High, class Value>
  Value Of(const fields::Range<Low, High>& rule, Value* /*type*/) const {
    return static_cast<Value>(Within(fields::LimitOf(rule.low, message), fields::LimitOf(rule.high, message)));
  }
  template <class Low, class Value>
  Value Of(const fields::AtLeast<Low>& rule, Value* /*type*/) const {
    constexpr int kMore = 100;
    return static_cast<Value>(fields::LimitOf(rule.low, message) + kMore + number);
  }
  template <class Value>
  Value Of(const fields::NonZero& /*rule*/, Value* /*type*/) const {
    return static_cast<Value>(-number);
  }
  template <class Enum, class Value>
  Value Of(const fields::ValueOf<Enum>& /*rule*/, Value* /*type*/) const {
    return static_cast<Value>(kNumEnumerators<Enum> - 1);
  }
  template <class Enum>
  std::string Of(const fields::EnumNameOf<Enum>& /*rule*/, std::string* /*type*/) const {
    return std::string(kEnumNames<Enum>.back().word);
  }
  template <class Least, class Most>
  std::string Of(const fields::Text<Least, Most>& rule, std::string* /*type*/) const {
    return Named(fields::LimitOf(rule.most, message));
  }
  template <class Rule>
  std::string Of(const fields::Cleaned<Rule>& rule, std::string* type) const {
    return Of(rule.rule, type);
  }
  template <class Least, class Most>
  std::string Of(const fields::Json<Least, Most>& /*rule*/, std::string* /*type*/) const {
    return R"({")" + std::string(name) + R"(":[1]})";
  }
  std::string Of(const fields::Hash& /*rule*/, std::string* /*type*/) const {
    constexpr std::size_t kDigits = 64;
    return std::string(kDigits, "0123456789abcdef"[number % 16]);
  }
  double Of(const fields::NanOrFinite& /*rule*/, double* /*type*/) const { return 1.0 / number; }
  double Of(const fields::Finite& /*rule*/, double* /*type*/) const {
    constexpr std::array kFigures = {1., -2., 3.5, 0., -0.0, 1e300};
    return kFigures.at(static_cast<std::size_t>(number) % kFigures.size());
  }
  template <class Array>
  std::int32_t Of(const fields::CountOf<Message, Array>& /*rule*/, std::int32_t* /*type*/) const {
    return 0;  // set from the array's size
  }
};

template <class Message, class Value, class Rule>
void Fill(Message& message, const fields::Field<Message, Value, Rule>& field, int number) {
  Value& value = message.*field.member;
  const auto sample = [&](const auto& rule, auto* type, int of) {
    return Sampler<Message>{message, field.name, of}.Of(rule, type);
  };
  if constexpr (std::is_array_v<Value>) {
    for (auto& element : value) element = sample(field.rule, &element, ++number);
  } else if constexpr (fields::kIsVector<Value>) {
    using Element = typename Value::value_type;
    constexpr int kElements = 3;
    for (int i = 0; i < kElements; ++i) {
      Element* const type = nullptr;
      if constexpr (fields::kIsMessage<Element>) {
        value.push_back(Sample<Element>());
      } else if constexpr (std::is_same_v<Rule, fields::AnyValue>) {
        value.push_back(sample(field.rule, type, number + i));
      } else {
        value.push_back(sample(field.rule.element, type, number + i));
      }
    }
  } else {
    value = sample(field.rule, &value, number);
  }
}

}  // namespace sample_internal

template <class Message>
Message Sample() {
  Message message{};
  int number = 0;
  std::apply([&](const auto&... field) { (sample_internal::Fill(message, field, ++number), ...); }, kFields<Message>);
  sample_internal::Agree(message);
  fields::Sanitize(message);
  return message;
}

}  // namespace legopt::bus
