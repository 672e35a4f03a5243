#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace legopt {

/// Bad input from outside the program (URDF, mesh, dataset, suite, solution file, option).
///
/// Thrown by every loader and validator of the library. It names where the fault is and how to mend it, so that a
/// program can print `what()` as it stands: "FILE: FIELD: MESSAGE (got VALUE); FIX". Of several faults, each has a
/// line.
class InputError : public std::runtime_error {
 public:
  /// One fault: where it is, what it is, what mends it.
  struct Fault {
    std::string file;     ///< path, or a description of the source when there is no file
    std::string field;    ///< element, key or line; may be empty
    std::string value;    ///< offending value as text; may be empty
    std::string message;  ///< what is wrong
    std::string fix;      ///< what the user can do; may be empty
  };

  /// Of one fault.
  explicit InputError(Fault fault) : std::runtime_error(TextOf(fault)), faults_{std::move(fault)} {}

  /// Of one fault or more, for readers that look at all before they refuse.
  static InputError Of(std::vector<Fault> faults) {
    std::string lines;
    for (const Fault& fault : faults) lines += (lines.empty() ? "" : "\n") + TextOf(fault);
    return {lines, std::move(faults)};
  }

  /// The first one.
  const Fault& fault() const { return faults_.front(); }
  const std::vector<Fault>& faults() const { return faults_; }  ///< at least one, in the order in which they were found

  /// A fault as a sentence.
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
