#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace legopt {

/// A string stream that does not follow the global locale: numbers have a decimal point and no thousands separators.
template <class Stream>
class ClassicStream : public Stream {
 public:
  ClassicStream() { this->imbue(std::locale::classic()); }
  explicit ClassicStream(const std::string& text) : Stream(text) { this->imbue(std::locale::classic()); }
};

using ClassicInput = ClassicStream<std::istringstream>;   ///< input stream over a text
using ClassicOutput = ClassicStream<std::ostringstream>;  ///< output stream to a text

}  // namespace legopt
