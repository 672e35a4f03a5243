#include "app/folder_cache.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/isolated_call.h"
#include "legopt/files/written_file.h"
#include "legopt/math/blake2b.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader = "legopt-cache/1\n";
constexpr std::string_view kSuffix = ".cache";
constexpr std::size_t kChecksumBytes = 16;

bool IsKey(std::string_view key) {
  return !key.empty() && key.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

FolderCache::FolderCache(fs::path folder, std::uintmax_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {}

fs::path FolderCache::FileOf(std::string_view key) const { return folder_ / (std::string(key) + std::string(kSuffix)); }

std::optional<std::string> FolderCache::Read(std::string_view key) const {
  if (!IsKey(key)) return std::nullopt;
  const fs::path path = FileOf(key);
  std::error_code error;
  const std::uintmax_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
  if (error || size < kHeader.size() + 2 * kChecksumBytes || size > max_bytes_) return std::nullopt;
  const fs::file_time_type time = fs::last_write_time(path, error);
  std::string text(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(text.data(), static_cast<std::streamsize>(size)) || !text.starts_with(kHeader)) return std::nullopt;
  const std::string checksum = text.substr(kHeader.size(), 2 * kChecksumBytes);
  text.erase(0, kHeader.size() + 2 * kChecksumBytes);
  if (IsVerified(key, time)) return text;
  if (Blake2bHex(std::string(key) + text, kChecksumBytes) != checksum) return std::nullopt;
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);  // marks it as used
  const fs::file_time_type marked = fs::last_write_time(path, error);
  const std::scoped_lock lock(mutex_);
  verified_.insert_or_assign(std::string(key), marked);
  return text;
}

bool FolderCache::IsVerified(std::string_view key, fs::file_time_type time) const {
  const std::scoped_lock lock(mutex_);
  const auto known = verified_.find(key);
  return known != verified_.end() && known->second == time;
}

void FolderCache::Write(std::string_view key, std::string_view bytes) const {
  if (!IsKey(key) || bytes.size() > max_bytes_ / 4) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  try {
    const std::string checksum = Blake2bHex(std::string(key) + std::string(bytes), kChecksumBytes);
    files::ReplaceFile(FileOf(key), std::string(kHeader) + checksum + std::string(bytes),
                       {files::kReadableByOwner, files::Durability::kBuffered});
    RemoveOldest();
  } catch (const std::exception&) {  // the cache saves time only
  }
}

void FolderCache::RemoveOldest() const {
  struct Entry {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t bytes;
  };
  std::vector<Entry> entries;
  std::uintmax_t total = 0;
  std::error_code error;
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    std::error_code gone;  // another process may remove the file at the same time
    if (it->path().extension() != kSuffix || !it->is_regular_file(gone)) continue;
    Entry entry{it->last_write_time(gone), it->path(), it->file_size(gone)};
    if (gone) continue;
    total += entry.bytes;
    entries.push_back(std::move(entry));
  }
  if (total <= max_bytes_) return;
  std::ranges::sort(entries, {}, &Entry::used);
  for (const Entry& entry : entries) {
    if (total <= max_bytes_) return;
    fs::remove(entry.path, error);
    total -= entry.bytes;
  }
}

std::shared_ptr<const ByteCache> MeshCache() {
  const auto text = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::string(value == nullptr ? "" : value);
  };
  if (const std::string folder = text("LEGOPT_CACHE"); !folder.empty()) {
    return folder == "off" ? nullptr : std::make_shared<FolderCache>(folder);
  }
  if (const fs::path folder = text("XDG_CACHE_HOME"); folder.is_absolute()) {
    return std::make_shared<FolderCache>(folder / "legopt" / "meshes");
  }
  if (const fs::path folder = text("HOME"); folder.is_absolute()) {
    return std::make_shared<FolderCache>(folder / ".cache" / "legopt" / "meshes");
  }
  return nullptr;
}

ReadGuard GuardedReader() { return {CallIsolated, MeshCache()}; }

}  // namespace legopt
