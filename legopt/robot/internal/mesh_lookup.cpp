#include "legopt/robot/internal/mesh_lookup.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <system_error>
#include <utility>

#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string Decoded(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte =
        text[i] == '%' ? ParseInteger<unsigned>(std::string_view(text).substr(i + 1, 2), 16) : std::nullopt;
    const bool is_code = byte && *byte >= 0x20U && i + 2 < text.size();
    result += is_code ? static_cast<char>(*byte) : text[i];
    if (is_code) i += 2;
  }
  return result;
}

/// Adds the files below `folder` whose path equals the parts from `part` on without regard to case.
void CollectWithoutCase(const fs::path& folder, fs::path::iterator part, fs::path::iterator end,
                        std::vector<fs::path>* found) {
  if (part == end) {
    if (IsFile(folder)) found->push_back(folder);
    return;
  }
  const fs::path name = *part++;
  if (name == "..") return CollectWithoutCase(folder.parent_path(), part, end, found);
  if (name == ".") return CollectWithoutCase(folder, part, end, found);
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (Lower(entry->path().filename().string()) == Lower(name.string())) {
      CollectWithoutCase(entry->path(), part, end, found);
    }
  }
}

/// Returns the only file below `folder` whose path equals `inside` without regard to case.
std::optional<fs::path> WithoutCase(const fs::path& folder, const fs::path& inside) {
  std::vector<fs::path> found;
  CollectWithoutCase(folder, inside.begin(), inside.end(), &found);
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

/// Looks for a relative path in the folder and in all folders above it.
template <class Look>
std::optional<fs::path> Upwards(const fs::path& folder, const Look& look) {
  for (fs::path at = folder;; at = at.parent_path()) {
    if (const std::optional<fs::path> found = look(at)) return found;
    if (at == at.parent_path()) return std::nullopt;
  }
}

/// A mesh name without its scheme.
struct MeshName {
  bool in_package = false;    ///< path begins with a package's name
  bool names_package = true;  ///< the name of the package is not empty
  fs::path path;
};

MeshName Parsed(std::string_view text) {
  for (const std::string_view scheme : {"package://", "model://"}) {
    if (!text.starts_with(scheme)) continue;
    text.remove_prefix(scheme.size());
    const bool names_package = !text.starts_with('/');
    while (text.starts_with('/')) text.remove_prefix(1);
    return {true, names_package, text};
  }
  constexpr std::string_view kFile = "file://";
  if (text.starts_with(kFile)) text.remove_prefix(kFile.size());
  return {false, true, text};
}

std::optional<fs::path> Find(const MeshName& name, const fs::path& folder, bool ignore_case) {
  const auto look = [&](const fs::path& at) -> std::optional<fs::path> {
    if (ignore_case) return WithoutCase(at, name.path);
    return IsFile(at / name.path) ? std::optional(at / name.path) : std::nullopt;
  };
  if (name.path.is_absolute()) return IsFile(name.path) ? std::optional(name.path) : std::nullopt;
  return name.in_package ? Upwards(folder, look) : look(folder);
}

/// Looks for ever shorter ends of a path: without the package, then without the first folders.
std::optional<fs::path> FindEnd(const MeshName& name, const fs::path& folder, bool ignore_case) {
  fs::path rest = name.path.relative_path();
  while (std::distance(rest.begin(), rest.end()) > 1) {
    fs::path shorter;
    for (auto part = std::next(rest.begin()); part != rest.end(); ++part) shorter /= *part;
    rest = shorter;
    if (const auto found = Find({true, true, rest}, folder, ignore_case)) return found;
  }
  return std::nullopt;
}

}  // namespace

std::optional<FoundMesh> FindMesh(const std::string& name, const fs::path& folder) {
  std::string text = name, changes;
  const auto result = [&](const fs::path& path, const std::string& fallback) {
    const std::string both = changes.empty() || fallback.empty() ? "" : ", ";
    return FoundMesh{fs::absolute(path).lexically_normal(), changes + both + fallback};
  };
  const auto change = [&](std::string changed, const char* how) {
    if (changed == text) return;
    changes += (changes.empty() ? "" : ", ") + std::string(how);
    text = std::move(changed);
  };
  if (const auto found = Find(Parsed(text), folder, false)) {
    return result(*found, Parsed(text).names_package ? "" : "without the name of a package");
  }
  std::string with_slashes = text;
  std::ranges::replace(with_slashes, '\\', '/');
  change(std::move(with_slashes), "with '/' instead of '\\'");
  if (const auto found = Find(Parsed(text), folder, false)) return result(*found, "");
  change(Decoded(text), "with %XX decoded");
  if (const auto found = Find(Parsed(text), folder, false)) return result(*found, "");
  for (const bool ignore_case : {false, true}) {
    const std::string by_case = ignore_case ? "without regard to case" : "";
    if (const auto found = ignore_case ? Find(Parsed(text), folder, true) : std::nullopt) {
      return result(*found, by_case);
    }
    if (const auto found = FindEnd(Parsed(text), folder, ignore_case)) {
      return result(*found, (ignore_case ? by_case + ", " : "") + "by the end of its path");
    }
  }
  return std::nullopt;
}

std::optional<FoundMesh> FindMesh(const std::string& name, const fs::path& folder, const std::vector<fs::path>& more) {
  std::optional<FoundMesh> found = FindMesh(name, folder);
  for (auto next = more.begin(); !found && next != more.end(); ++next) {
    found = FindMesh(name, fs::absolute(*next).lexically_normal());
  }
  return found;
}

}  // namespace legopt
