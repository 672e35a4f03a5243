#pragma once

#include <any>
#include <typeindex>
#include <typeinfo>
#include <utility>

#include "legopt/solvers/option_fields.h"

namespace legopt {

/// Options of a solver outside the library, of any copyable type with a Visit (option_fields.h). A value, like the
/// options structs themselves.
class CustomOptions {
 public:
  template <class Options>
  /// Stores a copy of options of any type that has a Visit.
  explicit CustomOptions(Options options)
      : options_(std::move(options)),
        edit_([](std::any& any, OptionFields& fields) { Options::Visit(*std::any_cast<Options>(&any), fields); }),
        view_([](const std::any& any, ConstOptionFields& fields) {
          Options::Visit(*std::any_cast<Options>(&any), fields);
        }) {}

  /// Returns the options, or null if they are of another type.
  template <class Options>
  Options* Get() {
    return std::any_cast<Options>(&options_);
  }
  /// Returns the options read-only, or null if they are of another type.
  template <class Options>
  const Options* Get() const {
    return std::any_cast<Options>(&options_);
  }

  std::type_index type() const { return options_.type(); }  ///< type of the stored options

  /// Visits the fields of the stored options; the visitor may change them.
  static void Visit(CustomOptions& options, OptionFields& fields) { options.edit_(options.options_, fields); }
  /// Visits the fields of the stored options read-only, for checkers and writers.
  static void Visit(const CustomOptions& options, ConstOptionFields& fields) {
    options.view_(options.options_, fields);
  }

 private:
  std::any options_;
  void (*edit_)(std::any& options, OptionFields& fields);
  void (*view_)(const std::any& options, ConstOptionFields& fields);
};

}  // namespace legopt
