#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Visitor of a set of options. Each options struct lists its fields once, for reading, writing, checking and
/// hashing, in a template that takes the struct as it is or const:
///
///     struct DescentOptions {
///       double step = 0.1;  ///< length of a step, > 0
///       StepRule rule = StepRule::kFixed;
///
///       static void Visit(auto& options, auto& fields) {
///         fields.Number("step", options.step, 1e-9, 10.0);
///         fields.Choice("rule", options.rule);
///       }
///     };
///
/// `fields` is then an OptionFields, which may change the values, or a ConstOptionFields, which may not. Keys are the
/// keys used in files. A struct that contains another options struct calls the latter's Visit.
template <bool is_const>
class BasicOptionFields {
 public:
  template <class T>
  /// Type of a field as Visit passes it: a mutable or a const reference.
  using Field = std::conditional_t<is_const, const T&, T&>;

  virtual ~BasicOptionFields() = default;

  /// Visits a number in [low, high].
  virtual void Number(const char* key, Field<double> value, double low, double high) = 0;
  /// Visits an integer in [low, high].
  virtual void Integer(const char* key, Field<int> value, int low, int high) = 0;
  virtual void Boolean(const char* key, Field<bool> value) = 0;  ///< Visits a boolean.
  /// Visits a BLAKE2b-256 digest (64 lower-case hexadecimal digits) of data that belongs to a method but is stored
  /// outside of it.
  virtual void Digest(const char* key, Field<std::string> value) = 0;

  /// Visits a value of an enumeration by its name.
  template <class Enum>
  requires NamedEnum<std::remove_const_t<Enum>>
  void Choice(const char* key, Enum& value) {
    auto index = static_cast<std::size_t>(value);
    Word(key, index, kEnumNameList<std::remove_const_t<Enum>>);
    if constexpr (!is_const) value = static_cast<Enum>(index);
  }

  /// Visits an enumeration that was added after results had been published. It is not written while it has its `usual`
  /// value, so that methods without it keep their canonical form and hash.
  template <class Enum>
  requires NamedEnum<std::remove_const_t<Enum>>
  void ChoiceWithDefault(const char* key, Enum& value, std::remove_const_t<Enum> usual) {
    if (value != usual || !omits_defaults()) Choice(key, value);
  }

  /// Visits an integer that was added later, as ChoiceWithDefault.
  void IntegerWithDefault(const char* key, Field<int> value, int low, int high, int usual) {
    if (value != usual || !omits_defaults()) Integer(key, value, low, high);
  }

  /// Visits a number that was added later, as ChoiceWithDefault.
  void NumberWithDefault(const char* key, Field<double> value, double low, double high, double usual) {
    if (value != usual || !omits_defaults()) Number(key, value, low, high);
  }

  /// Declares a removed key. Files that still contain it get an error with `fix`, the text to write instead.
  virtual void RemovedKey(const char* /*key*/, const char* /*fix*/) {}

  /// Checks a condition between two fields that have been visited. Errors are reported at `key` with its value as text.
  /// The check is skipped if one of the two fields is invalid by itself.
  virtual void Require(bool condition, const char* key, const char* other, const std::string& value,
                       const std::string& message, const std::string& fix) = 0;

 protected:
  /// Returns whether a later option with its usual value is left out.
  virtual bool omits_defaults() const { return false; }

  /// Implements Choice: `index` is the position in `words`; larger indices are invalid.
  virtual void Word(const char* key, Field<std::size_t> index, std::span<const std::string_view> words) = 0;

 private:
  template <class Enum>
  static constexpr auto kEnumNameList = [] {
    std::array<std::string_view, kNumEnumerators<Enum>> words;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = kEnumNames<Enum>[i].word;
    return words;
  }();
};

/// Visitors that may change the values: readers.
using OptionFields = BasicOptionFields<false>;
/// Visitors that may not change the values: checkers, writers, hashes.
using ConstOptionFields = BasicOptionFields<true>;

}  // namespace legopt
