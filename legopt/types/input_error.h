#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace legopt {

/// Bad input from outside the program (URDF, mesh, dataset, suite, solution file, option).
///
/// Thrown by every loader and validator of the library. `what()` can be printed as it is: one line per fault, "FILE:
/// FIELD: MESSAGE (got VALUE); FIX".
class InputError : public std::runtime_error {
 public:
  /// One fault: its location, the problem, and the fix.
  struct Fault {
    std::string file;     ///< path, or a description of the source if there is no file
    std::string field;    ///< element, key or line; may be empty
    std::string value;    ///< offending value as text; may be empty
    std::string message;  ///< the problem
    std::string fix;      ///< advice to the user; may be empty
  };

  explicit InputError(Fault fault) : std::runtime_error(TextOf(fault)), faults_{std::move(fault)} {}

  /// Returns an error with one or more faults, for readers that collect all faults before they throw.
  static InputError Of(std::vector<Fault> faults) {
    std::string lines;
    for (const Fault& fault : faults) lines += (lines.empty() ? "" : "\n") + TextOf(fault);
    return {lines, std::move(faults)};
  }

  /// First fault.
  const Fault& fault() const { return faults_.front(); }
  const std::vector<Fault>& faults() const { return faults_; }  ///< one or more, in the order of detection

  /// Formats a fault as one sentence.
  static std::string TextOf(const Fault& fault) {
    std::string text = fault.file;
    if (!fault.field.empty()) text += (text.empty() ? "" : ": ") + fault.field;
    text += (text.empty() ? "" : ": ") + fault.message;
    if (!fault.value.empty()) text += " (got '" + fault.value + "')";
    if (!fault.fix.empty()) text += "; " + fault.fix;
    return text;
  }

 private:
  InputError(const std::string& lines, std::vector<Fault> faults)
      : std::runtime_error(lines), faults_(std::move(faults)) {}

  std::vector<Fault> faults_;
};

}  // namespace legopt
