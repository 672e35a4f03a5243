#include "legopt/geometry/stl_repair.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "legopt/input/file_text.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

constexpr std::size_t kMaxStlBytes = std::size_t{2} << 30;
constexpr std::size_t kHeader_bytes = 80, kTriangle_bytes = 50;

std::string LowerCaseOf(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Returns true for text of the form "solid ... facet ...", in upper or lower case. The header of a binary file may
/// contain these words, but a text contains no NUL.
bool IsTextStl(const std::string& content) {
  constexpr std::size_t kNameEnds_bytes = 4096;
  const std::string lower = LowerCaseOf(content.substr(0, kNameEnds_bytes));
  if (lower.find('\0') != std::string::npos) return false;
  const std::size_t first = lower.find_first_not_of(" \t\r\n");
  return first != std::string::npos && lower.compare(first, 5, "solid") == 0 &&
         lower.find("facet") != std::string::npos;
}

constexpr std::array<std::string_view, 4> kKeywords = {"solid", "facet", "loop", "vertex"};

std::size_t CountOf(std::string_view keyword, const std::string& content) {
  std::size_t count = 0;
  for (std::size_t at = content.find(keyword); at != std::string::npos; at = content.find(keyword, at + 1)) ++count;
  return count;
}

[[noreturn]] void RefuseCount(const std::string& path, std::uint64_t count, std::size_t bytes) {
  throw InputError({path, "number of triangles", std::to_string(count),
                    "does not fit the file, which has room for " +
                        std::to_string((bytes - kHeader_bytes - sizeof(std::uint32_t)) / kTriangle_bytes),
                    "export the mesh again; the file is cut off, or its header is wrong"});
}

}  // namespace

std::optional<std::string> RepairStl(const std::string& path) {
  if (LowerCaseOf(std::filesystem::path(path).extension().string()) != ".stl") return std::nullopt;
  std::string content = ReadFileText(path, kMaxStlBytes);
  if (IsTextStl(content)) {
    std::string lower = LowerCaseOf(content);
    const bool as_expected = std::ranges::all_of(
        kKeywords, [&](std::string_view keyword) { return CountOf(keyword, content) == CountOf(keyword, lower); });
    return as_expected ? std::nullopt : std::optional(std::move(lower));
  }
  if (content.size() < kHeader_bytes + sizeof(std::uint32_t)) return std::nullopt;
  std::uint32_t count = 0;
  std::memcpy(&count, content.data() + kHeader_bytes, sizeof(count));
  const std::size_t start = kHeader_bytes + sizeof(count), needed = start + std::size_t{count} * kTriangle_bytes;
  if (count == 0 || needed == content.size()) return std::nullopt;
  // Complete triangles after the last one are not trailing bytes: the header must be wrong.
  if (needed > content.size() || content.size() - needed >= kTriangle_bytes) RefuseCount(path, count, content.size());
  content.resize(needed);
  return content;
}

}  // namespace legopt
