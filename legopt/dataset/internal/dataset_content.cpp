#include "legopt/dataset/internal/dataset_content.h"

#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "legopt/dataset/internal/contact_file.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/self_collision_file.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytesOfFile = std::size_t{4} << 30;
constexpr const char* kPlainCharacters =  // characters that need no quotes in YAML
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";

[[noreturn]] void Fail(const fs::path& path, std::string message, std::string fix) {
  throw InputError(
      {.file = path.string(), .field = "", .value = "", .message = std::move(message), .fix = std::move(fix)});
}

std::string RelativePath(const fs::path& folder, const std::string& mesh_file) {
  const fs::path relative = fs::path(mesh_file).lexically_normal().lexically_relative(folder.lexically_normal());
  if (relative.empty() || *relative.begin() == "..") {
    Fail(mesh_file, "the mesh lies outside the dataset folder " + folder.string(), "move it into the folder");
  }
  return relative.generic_string();
}

/// Returns `text` without its top-level `files:` block; `position` is the block's former position, or npos.
std::string RemoveFilesBlock(const std::string& text, size_t* position) {
  std::string kept;
  *position = std::string::npos;
  bool inside = false;
  for (size_t begin = 0; begin < text.size();) {
    const size_t newline = text.find('\n', begin);
    const size_t end = newline == std::string::npos ? text.size() : newline + 1;
    const std::string line = text.substr(begin, end - begin);
    const bool top_level = line.find_first_of(" \t\r\n#}") != 0;
    if (inside && top_level) inside = false;
    if (!inside && line.starts_with("files:")) {
      inside = true;
      *position = kept.size();
    }
    // An unindented comment ends the block: it belongs to the lines after it.
    if (inside && line.starts_with("#")) inside = false;
    if (!inside) kept += line;
    begin = end;
  }
  return kept;
}

std::string FormatFilesBlock(const std::vector<FileHash>& manifest) {
  std::string block = "files:\n";
  for (const FileHash& file : manifest) {
    const bool plain = file.path.find_first_not_of(kPlainCharacters) == std::string::npos;
    block += "  " + (plain ? file.path : Dump(nlohmann::json(file.path))) + ": " + file.hash + "\n";
  }
  return block;
}

}  // namespace

std::string HashFile(const fs::path& path) { return Blake2bHex(ReadFileText(path, kMaxBytesOfFile)); }

std::vector<std::string> ListUsedFiles(const fs::path& folder, const DatasetDescription& description,
                                       const RobotModel& robot, const Scene& scene) {
  std::vector<std::string> paths = {description.robot_file, description.scene_file};
  std::copy_if(description.problem_files.begin(), description.problem_files.end(), std::back_inserter(paths),
               [](const std::string& file) { return !file.empty(); });
  const auto add_mesh = [&](const ShapeSpec& shape) {
    if (shape.kind == ShapeSpec::Kind::kMesh) paths.push_back(RelativePath(folder, shape.mesh_file));
  };
  for (const Link& link : robot.links()) std::for_each(link.collision.begin(), link.collision.end(), add_mesh);
  for (const SceneObject& object : scene.objects) add_mesh(object.shape);
  std::sort(paths.begin(), paths.end());
  paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
  return paths;
}

std::vector<FileHash> ComputeManifest(const fs::path& folder, const ReadGuard& guard) {
  const fs::path absolute = fs::weakly_canonical(folder);
  const DatasetDescription description = DescribeDataset(absolute);
  const RobotModel robot = RobotModel::FromUrdfFile((absolute / description.robot_file).string(), guard);
  const Scene scene = ReadSceneFile(absolute / description.scene_file, guard);
  std::vector<FileHash> manifest;
  for (const std::string& path : ListUsedFiles(absolute, description, robot, scene)) {
    manifest.push_back({.path = path, .hash = HashFile(absolute / path)});
  }
  return manifest;
}

std::vector<FileHash> WriteManifestHashes(const fs::path& folder, const ReadGuard& guard) {
  const fs::path path = folder / kDatasetFileName;
  if (!fs::exists(path))
    Fail(path, "does not exist", "a bare LegOpt folder has no manifest; write a dataset.yaml first");
  const std::string text = ReadFileText(path, kMaxBytesOfFile);
  const std::vector<FileHash> manifest = ComputeManifest(folder, guard);
  size_t position = 0;
  std::string kept = RemoveFilesBlock(text, &position);
  if (position == std::string::npos) {
    if (!kept.empty() && kept.back() != '\n') kept += '\n';
    position = kept.size();
  }
  kept.insert(position, FormatFilesBlock(manifest));
  WriteOutputFile(path, kept);
  return manifest;
}

std::string ContentHash(const DatasetDescription& description, const std::vector<FileHash>& manifest) {
  nlohmann::json text = {{"robot", description.robot_file},
                         {"scene", description.scene_file},
                         {"gravity_m_s2", description.gravity_m_s2},
                         {"nominal_posture", description.nominal_posture},
                         {"self_collision_reference", description.self_collision_reference},
                         {"files", nlohmann::json::object()}};
  if (const std::optional<double> sole_offset_m = CommonSoleOffset_m(description.contacts)) {
    text["format"] = kDatasetFormat1;
    text["sole_offset_m"] = *sole_offset_m;
    for (const ContactDescription& contact : description.contacts) text["feet"].push_back(contact.link);
  } else {
    text["format"] = kDatasetFormat2;
    text["contacts"] = CanonicalContacts(description.contacts);
  }
  for (const TaskDescription& row : ProblemTasks()) {
    text[std::string(ToString(row.task))] = description.problem_files[row.task];
  }
  if (!description.support.empty()) text["support"] = description.support;
  if (!description.effort_limits.empty()) text["effort_limits"] = description.effort_limits;
  if (!description.velocity_limits.empty()) text["velocity_limits"] = description.velocity_limits;
  if (!description.trunk.empty()) text["trunk"] = description.trunk;
  if (description.self_collision) text["unchecked_pairs"] = CanonicalPairs(*description.self_collision);
  if (description.link_shapes != LinkRepresentation::kHulls) text["link_shapes"] = ToString(description.link_shapes);
  for (const FileHash& file : manifest) text["files"][file.path] = file.hash;
  return Blake2bHex(Dump(text));
}

namespace {

constexpr char kFormat[] = "legopt-dataset-archive/1";
constexpr int kCompressionLevel = 3;
constexpr std::size_t kMaxFiles = 100'000;
constexpr std::size_t kMaxTableBytes = std::size_t{8} << 20;
constexpr std::int64_t kTableMemoryBytes = std::int64_t{256} << 20;
constexpr std::size_t kMaxPathBytes = 1024;
constexpr int kMaxPathDepth = 32;
constexpr std::size_t kAlwaysUnpackedBytes = std::size_t{64} << 20;  // any archive may unpack to this size
constexpr std::size_t kMaxExpansion = 100;  // maximum ratio of unpacked to packed bytes above that size
constexpr int kMaxWindowLog = 24;           // base-2 logarithm of the memory for decompression: 16 MiB

[[noreturn]] void Refuse(const std::string& message, const std::string& value = {}, const std::string& fix = {}) {
  throw InputError({"dataset archive", "", value, message, fix});
}

std::string Compressed(const std::string& plain) {
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) Refuse("cannot be compressed", ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

/// Streaming decompression of an archive, so that memory does not grow with its size.
class ArchiveStream {
 public:
  explicit ArchiveStream(std::string_view packed)
      : context_(ZSTD_createDCtx(), &ZSTD_freeDCtx),
        packed_{packed.data(), packed.size(), 0},
        buffer_(ZSTD_DStreamOutSize(), '\0') {
    const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) Refuse("is none");
    if (size > kMaxUnpackedBytes || size > kAlwaysUnpackedBytes + kMaxExpansion * packed.size()) {
      Refuse("is too large", std::to_string(size) + " bytes unpacked, of " + std::to_string(packed.size()));
    }
    bytes_left_ = size;
    ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, kMaxWindowLog);
  }

  /// Number of bytes that Next() has not returned yet.
  std::size_t bytes_left() const { return bytes_left_; }

  /// Returns the next bytes, between 1 and `most`; empty at the end. Valid until the next call.
  std::string_view Next(std::size_t most) {
    if (rest_.empty() && bytes_left_ > 0) Refill();
    const std::string_view piece = rest_.substr(0, most);
    rest_.remove_prefix(piece.size());
    bytes_left_ -= piece.size();
    return piece;
  }

  /// Throws unless the archive is complete and ends here.
  void RequireEnd() {
    if (bytes_left_ > 0) Refuse("is longer than its table says");
    while (!complete_) Refill();
    if (!rest_.empty() || packed_.pos != packed_.size) Refuse("is damaged");
  }

 private:
  void Refill() {
    ZSTD_outBuffer out{buffer_.data(), buffer_.size(), 0};
    const std::size_t before = packed_.pos;
    const std::size_t result = ZSTD_decompressStream(context_.get(), &out, &packed_);
    complete_ = result == 0;
    const bool stuck = out.pos == 0 && packed_.pos == before && !complete_;
    if (ZSTD_isError(result) != 0 || stuck || out.pos > bytes_left_ || (complete_ && out.pos < bytes_left_)) {
      Refuse("is damaged");
    }
    rest_ = std::string_view(buffer_).substr(0, out.pos);
    if (out.pos == 0 && bytes_left_ > 0) Refill();
  }

  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_;
  ZSTD_inBuffer packed_;
  std::string buffer_;
  std::string_view rest_;  // unread part of the buffer
  std::size_t bytes_left_ = 0;
  bool complete_ = false;
};

struct PackedFile {
  std::string path;
  std::size_t bytes = 0;
};

bool StaysInside(const std::string& path) {
  const fs::path name = path;
  return !path.empty() && path.find('\0') == std::string::npos && name.is_relative() && name.has_filename() &&
         path == name.lexically_normal().generic_string() && *name.begin() != ".." && *name.begin() != ".";
}

bool IsShort(const std::string& path) {
  return path.size() <= kMaxPathBytes && std::count(path.begin(), path.end(), '/') < kMaxPathDepth;
}

std::vector<PackedFile> ParseTable(std::string_view text) {
  const auto table = TryParseJson(text, {.bytes = kMaxTableBytes, .depth = 3, .values = 3 * kMaxFiles + 3});
  if (!table || !table->is_object() || table->value("format", nlohmann::json()) != kFormat ||
      !table->contains("files") || !table->at("files").is_array() || table->at("files").size() > kMaxFiles) {
    Refuse("has no table of its files", "", std::string("only ") + kFormat + " is known; use the same release");
  }
  std::vector<PackedFile> files;
  for (const nlohmann::json& row : table->at("files")) {
    const bool whole = row.is_object() && row.contains("path") && row["path"].is_string() && row.contains("bytes") &&
                       row["bytes"].is_number_unsigned();
    if (!whole) Refuse("has a table with a row that names no file");
    files.push_back({row["path"].get<std::string>(), row["bytes"].get<std::size_t>()});
    if (!StaysInside(files.back().path)) Refuse("names a file outside of its folder", files.back().path);
    if (!IsShort(files.back().path)) Refuse("names a file with too long a path", files.back().path.substr(0, 80));
  }
  return files;
}

// Serializes the result of ParseTable: 'f' and rows "BYTES PATH", each ended by NUL; or, if it throws, 'e' and message,
// value and fix, each ended by NUL.
std::string TableAnswer(std::string_view text) {
  std::string answer = "f";
  try {
    for (const PackedFile& file : ParseTable(text)) answer += std::to_string(file.bytes) + " " + file.path + '\0';
    return answer;
  } catch (const InputError& error) {
    const InputError::Fault& fault = error.fault();
    return "e" + fault.message + '\0' + fault.value.substr(0, fault.value.find('\0')) + '\0' + fault.fix + '\0';
  }
}

std::vector<std::string> TakeTexts(std::string_view answer) {
  std::vector<std::string> texts;
  for (std::size_t end = answer.find('\0'); end != std::string_view::npos; end = answer.find('\0')) {
    texts.emplace_back(answer.substr(0, end));
    answer.remove_prefix(end + 1);
  }
  return texts;
}

std::vector<PackedFile> ReadTable(const std::string& text, const ReadGuard& guard) {
  const auto read = [&text] { return TableAnswer(text); };
  std::string answer;
  try {
    answer = guard ? guard(read, {.cpu_s = 10, .wall_s = 60, .memory_bytes = kTableMemoryBytes}) : read();
  } catch (const GuardedReadError& error) {
    Refuse("has a table that cannot be read: " + std::string(error.what()));
  }
  const std::vector<std::string> texts = TakeTexts(std::string_view(answer).substr(answer.empty() ? 0 : 1));
  if (answer.starts_with('e') && texts.size() == 3) Refuse(texts[0], texts[1], texts[2]);
  std::vector<PackedFile> files;
  for (const std::string& row : texts) {
    const std::size_t blank = row.find(' ');
    const auto bytes = ParseInteger<std::size_t>(std::string_view(row).substr(0, blank));
    if (!bytes || blank == std::string::npos) Refuse("has a table that cannot be read");
    files.push_back({row.substr(blank + 1), *bytes});
    if (!StaysInside(files.back().path)) Refuse("names a file outside of its folder", files.back().path);
  }
  return files;
}

// Reads the table, which is the first line.
std::string TakeTable(ArchiveStream& archive) {
  std::string table;
  while (table.size() <= kMaxTableBytes) {
    const std::string_view byte = archive.Next(1);
    if (byte.empty()) break;
    if (byte == "\n") return table;
    table += byte;
  }
  Refuse("has no table of its files");
}

void RequireSizes(const std::vector<PackedFile>& files, std::size_t bytes) {
  for (const PackedFile& file : files) {
    if (file.bytes > bytes) Refuse("is shorter than its table says", file.path);
    bytes -= file.bytes;
  }
  if (bytes > 0) Refuse("is longer than its table says");
}

void UnpackFile(ArchiveStream& archive, std::size_t bytes, const fs::path& file) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  try {
    files::NewFile target(file, {files::kReadableByAll, files::Durability::kBuffered});
    while (bytes > 0) {
      const std::string_view piece = archive.Next(bytes);
      target.Write(piece);
      bytes -= piece.size();
    }
    target.Finish();
  } catch (const files::FileError& fault) {
    if (fault.shortage()) throw;
    throw InputError({file.string(), "", "", fault.reason(), ""});
  }
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
    const std::string bytes = ReadFileText(absolute / path, kMaxUnpackedBytes);
    if (contents.size() + bytes.size() > kMaxUnpackedBytes) break;  // rejected below
    table["files"].push_back({{"path", path}, {"bytes", bytes.size()}});
    contents += bytes;
  }
  std::string archive = Compressed(Dump(table) + "\n" + contents);
  if (archive.size() > kMaxArchiveBytes || table["files"].size() < paths.size()) {
    throw InputError({folder.string(), "", std::to_string(archive.size() >> 20) + " MiB packed",
                      "the dataset is too large to travel by itself, which ends at " +
                          std::to_string(kMaxArchiveBytes >> 20) + " MiB",
                      "copy it to the workers' machines, or to a folder that they see, and name that"});
  }
  return archive;
}

void UnpackDataset(std::string_view packed, const fs::path& folder, const ReadGuard& guard) {
  ArchiveStream archive(packed);
  const std::vector<PackedFile> files = ReadTable(TakeTable(archive), guard);
  RequireSizes(files, archive.bytes_left());
  for (const PackedFile& file : files) UnpackFile(archive, file.bytes, folder / file.path);
  archive.RequireEnd();
}

}  // namespace legopt
