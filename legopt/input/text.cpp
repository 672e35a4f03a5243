#include "legopt/input/text.h"

#include <fcntl.h>
#include <glib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <system_error>

#include "legopt/types/input_error.h"

namespace legopt {
namespace {

[[noreturn]] void RefuseUnreadable(const std::filesystem::path& path, int error) {
  if (error == EMFILE || error == ENFILE || error == ENOMEM) {
    throw std::system_error(error, std::generic_category(), path.string());
  }
  const bool folder = error == EISDIR;
  throw InputError({path.string(), "", "",
                    folder ? "cannot be read: it is a folder" : std::string("cannot be read: ") + std::strerror(error),
                    folder ? "name a file in it" : "check that the file exists and is readable"});
}

class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& path) : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_ < 0) RefuseUnreadable(path, errno);
  }
  ~OpenFile() { ::close(fd_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int fd() const { return fd_; }
  /// Size in bytes; 0 for what has none, such as a pipe.
  std::size_t size() const {
    struct stat state = {};
    return ::fstat(fd_, &state) == 0 && S_ISREG(state.st_mode) ? static_cast<std::size_t>(state.st_size) : 0;
  }

 private:
  int fd_;
};

}  // namespace

void RefusePointer(std::string_view start, const std::filesystem::path& path) {
  struct Pointer {
    std::string_view bytes;  ///< first bytes of the pointer
    const char* program;     ///< program that replaces it by the file
    const char* command;     ///< call of this program
  };
  constexpr std::array<Pointer, 2> kPointers = {
      {{"version https://git-lfs.github.com/spec/", "Git LFS", "git lfs pull"},
       {"/annex/objects/", "git-annex", "git annex get"}}};
  for (const Pointer& pointer : kPointers) {
    if (!start.starts_with(pointer.bytes)) continue;
    throw InputError({path.string(), "", "",
                      std::string("is a pointer of ") + pointer.program + ", not the file itself",
                      std::string("run '") + pointer.command + "' in its repository"});
  }
}

std::string ReadFileText(const std::filesystem::path& path, std::size_t most_bytes) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  const OpenFile file(path);
  std::string text;
  text.resize(std::min(file.size(), most_bytes) + 1);  // one more than the file has, to see its end
  for (std::size_t used = 0;;) {
    if (used == text.size()) text.resize(std::min(used + std::max(used, kBlock), most_bytes + 1));
    const ssize_t count = ::read(file.fd(), text.data() + used, text.size() - used);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) RefuseUnreadable(path, errno);
    used += static_cast<std::size_t>(count);
    if (used > most_bytes) {
      throw InputError({path.string(), "", "", "is larger than " + std::to_string(most_bytes >> 10U) + " KiB",
                        "no file of this kind is that large; check that it is the right one"});
    }
    if (count == 0) {
      text.resize(used);
      RefusePointer(text, path);
      return text;
    }
  }
}

namespace {

constexpr char32_t kFirstHighSurrogate = 0xD800, kFirstLowSurrogate = 0xDC00, kLastSurrogate = 0xDFFF;
constexpr char32_t kLastCode = 0x10FFFF, kFirstBeyond16Bits = 0x10000;
constexpr unsigned kTailBits = 6, kSurrogateBits = 10, kByteBits = 8;

bool IsSurrogate(char32_t code) { return code >= kFirstHighSurrogate && code <= kLastSurrogate; }

/// A Unicode encoding with units of two or four bytes.
struct WideEncoding {
  std::string_view name;
  std::string_view mark;
  std::size_t unit_bytes;
  bool little_endian;
};
// The byte order mark of UTF-32 begins with that of UTF-16.
constexpr std::array<WideEncoding, 4> kWideEncodings = {{{"UTF-32", {"\xFF\xFE\0\0", 4}, 4, true},
                                                         {"UTF-32", {"\0\0\xFE\xFF", 4}, 4, false},
                                                         {"UTF-16", "\xFF\xFE", 2, true},
                                                         {"UTF-16", "\xFE\xFF", 2, false}}};

/// Decodes a text of a wide encoding, one character at a time.
class WideReader {
 public:
  WideReader(std::string_view text, const WideEncoding& encoding) : text_(text), encoding_(encoding) {}

  bool at_end() const { return at_ == text_.size(); }
  std::size_t at() const { return at_; }

  /// Returns the next character; empty if it is invalid.
  std::optional<char32_t> Next() {
    const std::optional<char32_t> unit = NextUnit();
    if (!unit || *unit > kLastCode) return std::nullopt;
    if (!IsSurrogate(*unit)) return unit;
    if (encoding_.unit_bytes != 2 || *unit >= kFirstLowSurrogate) return std::nullopt;
    const std::optional<char32_t> low = NextUnit();
    if (!low || *low < kFirstLowSurrogate || *low > kLastSurrogate) return std::nullopt;
    return kFirstBeyond16Bits + ((*unit - kFirstHighSurrogate) << kSurrogateBits) + (*low - kFirstLowSurrogate);
  }

 private:
  std::optional<char32_t> NextUnit() {
    if (text_.size() - at_ < encoding_.unit_bytes) return std::nullopt;
    char32_t unit = 0;
    for (std::size_t i = 0; i < encoding_.unit_bytes; ++i) {
      const std::size_t place = encoding_.little_endian ? encoding_.unit_bytes - 1 - i : i;
      unit = (unit << kByteBits) | static_cast<unsigned char>(text_[at_ + place]);
    }
    at_ += encoding_.unit_bytes;
    return unit;
  }

  std::string_view text_;
  const WideEncoding& encoding_;
  std::size_t at_ = 0;
};

}  // namespace

Utf8Character FirstCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  char32_t code = lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0U) != 0x80U) return {};
    code = (code << 6U) | (byte & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kSmallest = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kSmallest[bytes] || surrogate || code > 0x10FFFF) return {};
  return {code, bytes};
}

std::size_t FirstInvalidByte(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = FirstCharacter(text.substr(at)).bytes;
    if (bytes == 0) return at;
    at += bytes;
  }
  return std::string_view::npos;
}

void AppendUtf8(char32_t code, std::string& text) {
  constexpr std::array<char32_t, 3> kLimits = {0x80, 0x800, 0x10000};
  constexpr std::array<unsigned, 4> kLeads = {0, 0xC0, 0xE0, 0xF0};
  std::size_t tails = 0;
  while (tails < kLimits.size() && code >= kLimits[tails]) ++tails;
  text += static_cast<char>(kLeads[tails] | (code >> (kTailBits * tails)));
  while (tails-- > 0) text += static_cast<char>(0x80U | ((code >> (kTailBits * tails)) & 0x3FU));
}

std::string FromMarkedEncoding(std::string text, const std::string& source) {
  const auto* encoding = std::find_if(kWideEncodings.begin(), kWideEncodings.end(),
                                      [&text](const WideEncoding& each) { return text.starts_with(each.mark); });
  if (encoding == kWideEncodings.end()) return text;
  std::string utf8;
  utf8.reserve(text.size());
  WideReader reader(std::string_view(text).substr(encoding->mark.size()), *encoding);
  while (!reader.at_end()) {
    const std::size_t at = encoding->mark.size() + reader.at();
    const std::optional<char32_t> code = reader.Next();
    if (!code) {
      throw InputError({source, "byte " + std::to_string(at), "",
                        "the text begins with the mark of " + std::string(encoding->name) + " and is not valid in it",
                        "save it as UTF-8"});
    }
    AppendUtf8(*code, utf8);
  }
  return utf8;
}

void RequireUtf8(std::string_view text, const std::string& source) {
  const std::size_t at = FirstInvalidByte(text);
  if (at == std::string_view::npos) return;
  constexpr std::string_view kDigits = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(text[at]);
  const std::string hexadecimal = {'0', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  throw InputError({source + ":" + std::to_string(line), "byte " + std::to_string(at), hexadecimal,
                    "the text is not UTF-8", "save it as UTF-8, for example with 'iconv -f latin1 -t utf-8'"});
}

namespace {

struct CodeRange {
  char32_t first, last;
};

// Characters that are invisible despite their Unicode category: joiners, fillers, selectors.
constexpr std::array<CodeRange, 8> kInvisible = {{{0x34F, 0x34F},
                                                  {0x115F, 0x1160},
                                                  {0x17B4, 0x17B5},
                                                  {0x180B, 0x180F},
                                                  {0x2800, 0x2800},
                                                  {0x3164, 0x3164},
                                                  {0xFE00, 0xFE0F},
                                                  {0xFFA0, 0xFFA0}}};
constexpr CodeRange kTagsAndSelectors = {0xE0000, 0xE0FFF};

bool Holds(const CodeRange& range, char32_t code) { return code >= range.first && code <= range.last; }

bool IsInvisible(char32_t code) {
  const auto type = g_unichar_type(code);
  return type == G_UNICODE_FORMAT || Holds(kTagsAndSelectors, code) ||
         std::any_of(kInvisible.begin(), kInvisible.end(),
                     [code](const CodeRange& range) { return Holds(range, code); });
}

std::string CodeName(char32_t code) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  constexpr int kMinDigits = 4;
  std::string digits;
  for (char32_t rest = code; rest > 0 || digits.size() < kMinDigits; rest >>= 4U) {
    digits.insert(digits.begin(), kDigits[rest & 0xFU]);
  }
  return "U+" + digits;
}

std::optional<NameDiagnostic> FindCharacterFault(char32_t code) {
  const auto type = g_unichar_type(code);
  if (type == G_UNICODE_CONTROL || type == G_UNICODE_LINE_SEPARATOR || type == G_UNICODE_PARAGRAPH_SEPARATOR) {
    return NameDiagnostic{"holds the control character " + CodeName(code), "remove it"};
  }
  if (IsInvisible(code)) return NameDiagnostic{"holds the invisible character " + CodeName(code), "remove it"};
  if (type == G_UNICODE_SPACE_SEPARATOR && code != ' ') {
    return NameDiagnostic{"holds the blank " + CodeName(code), "use an ordinary blank"};
  }
  return std::nullopt;
}

}  // namespace

std::string ToNfc(std::string_view text) {
  if (FirstInvalidByte(text) != std::string_view::npos) return std::string(text);
  const std::unique_ptr<char, decltype(&g_free)> composed(
      g_utf8_normalize(text.data(), static_cast<gssize>(text.size()), G_NORMALIZE_NFC), &g_free);
  return composed ? std::string(composed.get()) : std::string(text);
}

std::optional<NameDiagnostic> DiagnoseName(std::string_view name) {
  if (name.empty()) return NameDiagnostic{"is empty", "write a text"};
  if (FirstInvalidByte(name) != std::string_view::npos) return NameDiagnostic{"is not UTF-8", "write it in UTF-8"};
  for (std::string_view rest = name; !rest.empty();) {
    const Utf8Character character = FirstCharacter(rest);
    if (auto fault = FindCharacterFault(character.code)) return fault;
    rest.remove_prefix(character.bytes);
  }
  if (name.front() == ' ' || name.back() == ' ')
    return NameDiagnostic{"begins or ends with a blank", "remove the blank"};
  if (ToNfc(name) != name) {
    return NameDiagnostic{"is not in composed form (Unicode NFC): it would look like another name",
                          "write accented letters as one character each"};
  }
  return std::nullopt;
}

void RequireName(std::string_view name, const std::string& file, const std::string& field) {
  if (const auto fault = DiagnoseName(name)) {
    throw InputError({file, field, std::string(name), fault->message, fault->fix});
  }
}

}  // namespace legopt
