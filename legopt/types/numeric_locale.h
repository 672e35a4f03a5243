#pragma once

#include <clocale>

namespace legopt {

/// Sets the calling thread's locale for numbers to "C" until the end of the scope. Used around third-party libraries
/// that read or write numbers with the C library's locale (tinyxml2, urdfdom, assimp), so that a host program with a
/// decimal comma reads the same datasets. Other threads keep their locale. May be nested.
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
