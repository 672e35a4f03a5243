#pragma once

#include <clocale>

namespace legopt {

/// Gives the calling thread the C locale for numbers until it goes out of scope. Placed around third-party libraries
/// that read or write numbers by the C library's locale (tinyxml2, urdfdom, assimp), so that a host program with a
/// decimal comma gets the same datasets. Other threads keep their locale. It may be nested.
class ClassicNumericLocale {
 public:
  ClassicNumericLocale() : previous_(::uselocale(Classic())) {}
  ~ClassicNumericLocale() { ::uselocale(previous_); }
  ClassicNumericLocale(const ClassicNumericLocale&) = delete;
  ClassicNumericLocale& operator=(const ClassicNumericLocale&) = delete;

 private:
  static locale_t Classic() {
    static const locale_t kClassic = ::newlocale(LC_ALL_MASK, "C", nullptr);
    return kClassic;
  }

  locale_t previous_;
};

}  // namespace legopt
