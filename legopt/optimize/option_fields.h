#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "words/words.h"

namespace legopt {

/// Visitor of a set of options. Each struct of options lists its fields once, for reading, writing, checking and
/// hashing, in a template that takes itself as it is or const:
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
/// `fields` is then an OptionFields, which may change the values, or a ConstOptionFields, which may not. Keys are those
/// of files; a struct that holds another one has its Visit called in between.
template <bool is_const>
class BasicOptionFields {
 public:
  template <class T>
  /// How a Visit hands over a field: to be changed, or to be read only.
  using Field = std::conditional_t<is_const, const T&, T&>;

  virtual ~BasicOptionFields() = default;

  /// Values from `low` to `high`, both included.
  virtual void Number(const char* key, Field<double> value, double low, double high) = 0;
  /// Whole numbers from `low` to `high`, both included.
  virtual void Integer(const char* key, Field<int> value, int low, int high) = 0;
  virtual void Boolean(const char* key, Field<bool> value) = 0;  ///< true or false
  /// The BLAKE2b-256 of something, 64 lower-case hexadecimal digits: what belongs to a method without being in it.
  virtual void Digest(const char* key, Field<std::string> value) = 0;

  /// A value of an enumeration, by its word.
  template <class Enum>
  requires Worded<std::remove_const_t<Enum>>
  void Choice(const char* key, Enum& value) {
    auto index = static_cast<std::size_t>(value);
    Word(key, index, kWordsOnly<std::remove_const_t<Enum>>);
    if constexpr (!is_const) value = static_cast<Enum>(index);
  }

  /// The same for an option that came later than the results of others: while it has its `usual` value, it is not
  /// written, so that methods that leave it out keep their canonical form and hash.
  template <class Enum>
  requires Worded<std::remove_const_t<Enum>>
  void LaterChoice(const char* key, Enum& value, std::remove_const_t<Enum> usual) {
    if (value != usual || !leaves_usual_out()) Choice(key, value);
  }

  /// The same for a number.
  void LaterNumber(const char* key, Field<double> value, double low, double high, double usual) {
    if (value != usual || !leaves_usual_out()) Number(key, value, low, high);
  }

  /// A key that there was once. Who still writes it gets an error with `fix`, what to write instead.
  virtual void Former(const char* /*key*/, const char* /*fix*/) {}

  /// A condition between two fields that have been visited. `key` is the one to blame, with its value as text; it is
  /// not asked where one of the two is wrong by itself.
  virtual void Require(bool condition, const char* key, const char* other, const std::string& value,
                       const std::string& message, const std::string& fix) = 0;

 protected:
  /// Whether the usual value of a later option stays unsaid.
  virtual bool leaves_usual_out() const { return false; }

  /// What Choice comes down to: `index` is the place in `words`, or beyond them for what is no value.
  virtual void Word(const char* key, Field<std::size_t> index, std::span<const std::string_view> words) = 0;

 private:
  template <class Enum>
  static constexpr auto kWordsOnly = [] {
    std::array<std::string_view, kNumWords<Enum>> words;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = kWords<Enum>[i].word;
    return words;
  }();
};

/// What may change the values: readers.
using OptionFields = BasicOptionFields<false>;
/// What may not: checkers, writers, hashes.
using ConstOptionFields = BasicOptionFields<true>;

}  // namespace legopt
