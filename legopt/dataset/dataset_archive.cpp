#include "legopt/dataset/dataset_archive.h"

#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "legopt/dataset/content_hash.h"
#include "legopt/dataset/dataset_file.h"
#include "legopt/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr char kFormat[] = "legopt-dataset-archive/1";
constexpr int kCompressionLevel = 3;
constexpr std::size_t kMostFiles = 100'000;

[[noreturn]] void Refuse(const std::string& message, const std::string& value = {}, const std::string& fix = {}) {
  throw InputError({"dataset archive", "", value, message, fix});
}

std::string ReadBytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw InputError({file.string(), "", "", "cannot be read", "check that the file exists"});
  return bytes;
}

std::string Compressed(const std::string& plain) {
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) Refuse("cannot be compressed", ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

std::string Decompressed(std::string_view packed) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) Refuse("is none");
  if (size > kMostUnpackedBytes) Refuse("is too large", std::to_string(size) + " bytes");
  std::string plain(size, '\0');
  const std::size_t got = ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0 || got != size) Refuse("is damaged");
  return plain;
}

struct PackedFile {
  std::string path;
  std::size_t bytes = 0;
};

bool StaysInside(const std::string& path) {
  const fs::path name = path;
  return !path.empty() && path.find('\0') == std::string::npos && name.is_relative() && name.has_filename() &&
         path == name.lexically_normal().generic_string() && *name.begin() != ".." && *name.begin() != ".";
}

std::vector<PackedFile> ReadTable(std::string_view text) {
  const nlohmann::json table = nlohmann::json::parse(text, nullptr, false);
  if (!table.is_object() || table.value("format", nlohmann::json()) != kFormat || !table.contains("files") ||
      !table["files"].is_array() || table["files"].size() > kMostFiles) {
    Refuse("has no table of its files", "", std::string("only ") + kFormat + " is known; use the same release");
  }
  std::vector<PackedFile> files;
  for (const nlohmann::json& row : table["files"]) {
    const bool whole = row.is_object() && row.contains("path") && row["path"].is_string() && row.contains("bytes") &&
                       row["bytes"].is_number_unsigned();
    if (!whole) Refuse("has a table with a row that names no file");
    files.push_back({row["path"].get<std::string>(), row["bytes"].get<std::size_t>()});
    if (!StaysInside(files.back().path)) Refuse("names a file outside of its folder", files.back().path);
  }
  return files;
}

void WriteFile(const fs::path& file, std::string_view bytes) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  std::ofstream stream(file, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.flush();
  if (!stream) throw InputError({file.string(), "", "", "cannot be written", "check permissions and free space"});
}

}  // namespace

std::string HashOfDataset(const fs::path& folder, const ReadGuard& guard) {
  const fs::path absolute = fs::weakly_canonical(folder);
  return ContentHash(DescribeDataset(absolute), ComputeManifest(absolute, guard));
}

std::string PackDataset(const fs::path& folder, const ReadGuard& guard) {
  const fs::path absolute = fs::weakly_canonical(folder);
  std::vector<std::string> paths;
  if (!DescribeDataset(absolute).bare) paths.emplace_back(kDatasetFileName);
  for (FileHash& file : ComputeManifest(absolute, guard)) paths.push_back(std::move(file.path));

  nlohmann::json table = {{"format", kFormat}, {"files", nlohmann::json::array()}};
  std::string contents;
  for (const std::string& path : paths) {
    const std::string bytes = ReadBytes(absolute / path);
    if (contents.size() + bytes.size() > kMostUnpackedBytes) break;  // refused below
    table["files"].push_back({{"path", path}, {"bytes", bytes.size()}});
    contents += bytes;
  }
  std::string archive = Compressed(table.dump() + "\n" + contents);
  if (archive.size() > kMostArchiveBytes || table["files"].size() < paths.size()) {
    throw InputError({folder.string(), "", std::to_string(archive.size() >> 20) + " MiB packed",
                      "the dataset is too large to travel by itself, which ends at " +
                          std::to_string(kMostArchiveBytes >> 20) + " MiB",
                      "copy it to the workers' machines, or to a folder that they see, and name that"});
  }
  return archive;
}

void UnpackDataset(std::string_view archive, const fs::path& folder) {
  const std::string plain = Decompressed(archive);
  const auto table_end = plain.find('\n');
  if (table_end == std::string::npos) Refuse("has no table of its files");
  std::string_view rest = std::string_view(plain).substr(table_end + 1);
  const std::vector<PackedFile> files = ReadTable(std::string_view(plain).substr(0, table_end));
  for (const PackedFile& file : files) {
    if (file.bytes > rest.size()) Refuse("is shorter than its table says", file.path);
    WriteFile(folder / file.path, rest.substr(0, file.bytes));
    rest.remove_prefix(file.bytes);
  }
  if (!rest.empty()) Refuse("is longer than its table says");
}

}  // namespace legopt
