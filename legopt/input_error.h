#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace legopt {

/// Bad input from outside the program (URDF, mesh, dataset, suite, solution file, option).
///
/// Thrown by every loader and validator of the library. It names where the fault is and how to mend it, so that a
/// program can print `what()` as it stands: "FILE: FIELD: MESSAGE (got VALUE); FIX".
class InputError : public std::runtime_error {
 public:
  struct Fault {
    std::string file;     ///< path, or a description of the source when there is no file
    std::string field;    ///< element, key or line; may be empty
    std::string value;    ///< offending value as text; may be empty
    std::string message;  ///< what is wrong
    std::string fix;      ///< what the user can do; may be empty
  };

  explicit InputError(Fault fault) : std::runtime_error(Format(fault)), fault_(std::move(fault)) {}

  const Fault& fault() const { return fault_; }

 private:
  static std::string Format(const Fault& fault) {
    std::string text = fault.file;
    if (!fault.field.empty()) text += (text.empty() ? "" : ": ") + fault.field;
    text += (text.empty() ? "" : ": ") + fault.message;
    if (!fault.value.empty()) text += " (got '" + fault.value + "')";
    if (!fault.fix.empty()) text += "; " + fault.fix;
    return text;
  }

  Fault fault_;
};

}  // namespace legopt
