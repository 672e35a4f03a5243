#pragma once

#include <any>
#include <typeindex>
#include <typeinfo>
#include <utility>

#include "legopt/optimize/option_fields.h"

namespace legopt {

/// Options of a solver that is not of the library, whatever their type: any struct with a Visit (option_fields.h) that
/// can be copied. A value like the structs themselves.
class ForeignOptions {
 public:
  template <class Options>
  /// Holds a copy of options of any type that has a Visit.
  explicit ForeignOptions(Options options)
      : options_(std::move(options)),
        edit_([](std::any& any, OptionFields& fields) { Options::Visit(*std::any_cast<Options>(&any), fields); }),
        view_([](const std::any& any, ConstOptionFields& fields) {
          Options::Visit(*std::any_cast<Options>(&any), fields);
        }) {}

  /// Null when they are of another type.
  template <class Options>
  Options* Get() {
    return std::any_cast<Options>(&options_);
  }
  /// The same, for reading.
  template <class Options>
  const Options* Get() const {
    return std::any_cast<Options>(&options_);
  }

  std::type_index type() const { return options_.type(); }  ///< of the options held

  /// Visits the fields of the options held, for a reader that may change them.
  static void Visit(ForeignOptions& options, OptionFields& fields) { options.edit_(options.options_, fields); }
  /// The same for checkers and writers.
  static void Visit(const ForeignOptions& options, ConstOptionFields& fields) {
    options.view_(options.options_, fields);
  }

 private:
  std::any options_;
  void (*edit_)(std::any& options, OptionFields& fields);
  void (*view_)(const std::any& options, ConstOptionFields& fields);
};

}  // namespace legopt
