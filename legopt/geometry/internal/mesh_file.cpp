#include "legopt/geometry/internal/mesh_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "legopt/files/written_file.h"
#include "legopt/geometry/internal/mesh_reader.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr std::size_t kMaxGltfBytes = std::size_t{1} << 30;

[[noreturn]] void Refuse(const std::string& path, const std::string& field, const std::string& value,
                         const std::string& message) {
  constexpr std::size_t kShown = 60;
  throw InputError({path, field, value.substr(0, kShown), message, "export the mesh again or repair it"});
}

/// Checks a PLY header, line by line: only keywords of the format, each element once, and no more elements than the
/// file has bytes for. Assimp's reader writes out of bounds if a header repeats an element or has a malformed property.
/// It treats line ends at the start of binary data as part of the header, and then misreads the rest.
class PlyHeaderCheck {
 public:
  PlyHeaderCheck(const std::string& path, std::uintmax_t bytes) : path_(path), bytes_(bytes) {}

  void Run(std::istream& file) {
    constexpr int kMaxLines = 1000;
    std::string line;
    for (int number = 2; number <= kMaxLines && std::getline(file, line); ++number) {
      field_ = "header line " + std::to_string(number);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line == "end_header") {
        CheckFirstByte(file);
        return;
      }
      std::vector<std::string> words;
      ClassicInput stream(line);
      for (std::string word; stream >> word;) words.push_back(word);
      const std::string keyword = words.empty() ? "" : words.front();
      if (keyword == "comment" || keyword == "obj_info") continue;
      const bool known = (keyword == "format" && IsFormat(words)) || (keyword == "element" && IsElement(words)) ||
                         (keyword == "property" && IsProperty(words));
      if (!known) Refuse(path_, field_, line, "is no line of a PLY header");
    }
    Refuse(path_, "end_header", "", "the header has no end");
  }

 private:
  void CheckFirstByte(std::istream& file) const {
    if (!binary_ || (file.peek() != '\n' && file.peek() != '\r')) return;
    Refuse(path_, field_, "end_header", "the data begin with the byte of a line end, which could belong to the header");
  }

  bool IsFormat(const std::vector<std::string>& words) {
    binary_ = words.size() == 3 && words[1].starts_with("binary");
    return words.size() == 3 && words[2] == "1.0" &&
           (words[1] == "ascii" || words[1] == "binary_little_endian" || words[1] == "binary_big_endian");
  }

  bool IsElement(const std::vector<std::string>& words) {
    if (words.size() != 3) return false;
    std::uintmax_t count = 0;
    const char* end = words[2].data() + words[2].size();
    const auto [rest, fault] = std::from_chars(words[2].data(), end, count);
    if (fault != std::errc() || rest != end) return false;
    if (count > bytes_)
      Refuse(path_, field_, words[2], "the file is too short for so many");  // one byte each is the minimum
    if (!elements_.insert(words[1]).second) Refuse(path_, field_, words[1], "the element stands there twice");
    return true;
  }

  bool IsProperty(const std::vector<std::string>& words) const {
    if (elements_.empty()) return false;
    if (words.size() == 3) return IsType(words[1]);
    return words.size() == 5 && words[1] == "list" && IsType(words[2]) && IsType(words[3]);
  }

  static bool IsType(const std::string& word) {
    constexpr std::array<std::string_view, 16> kTypes = {"char",  "uchar",  "short",   "ushort", "int",   "uint",
                                                         "float", "double", "int8",    "uint8",  "int16", "uint16",
                                                         "int32", "uint32", "float32", "float64"};
    return std::find(kTypes.begin(), kTypes.end(), word) != kTypes.end();
  }

  const std::string& path_;
  const std::uintmax_t bytes_;
  std::string field_;
  bool binary_ = false;
  std::set<std::string> elements_;
};

/// Checks the header of any file with PLY's mark: assimp recognizes it whatever the suffix, in upper or lower case.
void CheckPlyHeader(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  const auto is = [&line](std::size_t i, char lower) { return i < line.size() && (line[i] | 0x20) == lower; };
  if (!std::getline(file, line) || !is(0, 'p') || !is(1, 'l') || !is(2, 'y')) return;
  std::error_code error;
  PlyHeaderCheck(path, std::filesystem::file_size(path, error)).Run(file);
}

/// Checks the numbers of a COLLADA file: every text that assimp reads as a list of numbers, and every attribute with a
/// count.
class ColladaCheck : public tinyxml2::XMLVisitor {
 public:
  ColladaCheck(const std::string& path, std::size_t bytes) : path_(path), bytes_(bytes) {}

  bool VisitEnter(const tinyxml2::XMLElement& element, const tinyxml2::XMLAttribute* /*first*/) override {
    constexpr std::array<const char*, 4> kSizes = {"count", "stride", "offset", "set"};
    for (const char* name : kSizes) {
      if (const char* value = element.Attribute(name)) CheckSize(element, name, value);
    }
    const std::string_view name = element.Name();
    if (const char* meter = name == "unit" ? element.Attribute("meter") : nullptr) CheckUnit(element, meter);
    constexpr std::array<std::string_view, 5> kIndexLists = {"p", "h", "v", "vcount", "int_array"};
    constexpr std::array<std::string_view, 7> kNumberLists = {"float_array", "matrix", "translate", "rotate",
                                                              "scale",       "skew",   "lookat"};
    constexpr std::string_view kNumberLetters = "+.eEinfaINFA";  // including those of inf and NaN
    if (std::find(kIndexLists.begin(), kIndexLists.end(), name) != kIndexLists.end()) CheckText(element, "");
    if (std::find(kNumberLists.begin(), kNumberLists.end(), name) != kNumberLists.end())
      CheckText(element, kNumberLetters);
    return true;
  }

 private:
  std::string Place(const tinyxml2::XMLElement& element) const {
    return "<" + std::string(element.Name()) + "> in line " + std::to_string(element.GetLineNum());
  }

  /// Checks the unit: assimp reads 0,01 as 0, and other text as some number or as no unit.
  void CheckUnit(const tinyxml2::XMLElement& element, const std::string& meter) const {
    const std::optional<double> unit_m = ParseNumber(meter);
    if (unit_m && *unit_m > 0.0 && std::isfinite(*unit_m)) return;
    Refuse(path_, Place(element) + ", meter", meter, "the unit of length must be a positive number");
  }

  /// Checks a count: array elements, accessor rows and corners of primitives take at least one byte each.
  void CheckSize(const tinyxml2::XMLElement& element, const char* name, const std::string& value) const {
    std::size_t size = 0;
    const auto [rest, fault] = std::from_chars(value.data(), value.data() + value.size(), size);
    if (fault == std::errc() && rest == value.data() + value.size() && size <= bytes_) return;
    Refuse(path_, Place(element) + ", " + name, value, "is no number of elements that this file could hold");
  }

  void CheckText(const tinyxml2::XMLElement& element, std::string_view also) const {
    for (const tinyxml2::XMLNode* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
      if (child->ToText() == nullptr) continue;
      const std::string_view text = child->Value();
      const auto strange = std::find_if(text.begin(), text.end(), [also](char c) {
        constexpr std::string_view kAlways = "-0123456789 \t\r\n";  // only the white space that the reader skips
        return kAlways.find(c) == std::string_view::npos && also.find(c) == std::string_view::npos;
      });
      if (strange != text.end())
        Refuse(path_, Place(element), std::string(strange, text.end()), "is no list of numbers");
    }
  }

  const std::string& path_;
  const std::size_t bytes_;
};

void CheckCollada(const std::string& path) {
  const std::string text = ReadFileText(path, kMaxMeshBytes);
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
    Refuse(path, "line " + std::to_string(document.ErrorLineNum()), "",
           std::string("not valid XML: ") + document.ErrorName());
  }
  ColladaCheck check(path, text.size());
  document.Accept(&check);
}

}  // namespace

bool LooksLikeCollada(const std::string& path) {
  constexpr std::size_t kMarkWithin = 1000;  // assimp searches fewer bytes for the mark
  std::string start(kMarkWithin, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), kMarkWithin);
  const auto lower = [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); };
  std::transform(start.begin(), start.end(), start.begin(), lower);
  std::string suffix = std::filesystem::path(path).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), lower);
  return suffix == ".dae" || start.find("<collada") != std::string::npos;
}

bool IsGltf(const std::string& path) {
  std::string suffix = std::filesystem::path(path).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix == ".gltf" || suffix == ".glb";
}

namespace {

/// Returns the JSON of a glTF file: all of a .gltf, the first chunk of a .glb.
std::string GltfJson(const std::string& path, std::string bytes) {
  if (!bytes.starts_with("glTF")) return bytes;
  constexpr std::size_t kLengthAt = 12, kJsonAt = 20;
  std::uint32_t length = 0;
  if (bytes.size() < kJsonAt) Refuse(path, "header", "", "the file ends early");
  std::memcpy(&length, bytes.data() + kLengthAt, sizeof(length));
  if (length > bytes.size() - kJsonAt) Refuse(path, "header", std::to_string(length), "the first chunk ends early");
  return bytes.substr(kJsonAt, length);
}

/// Checks the places of a glTF file's buffers: a file that came from elsewhere must not name files of this machine.
void CheckGltf(const std::string& path) {
  const nlohmann::json gltf =
      ParseJson(GltfJson(path, ReadFileText(path, kMaxGltfBytes)), path, {.bytes = kMaxGltfBytes});
  const auto buffers = gltf.is_object() ? gltf.find("buffers") : gltf.end();
  if (!gltf.is_object()) Refuse(path, "", "", "is no glTF file: its JSON is no object");
  if (buffers == gltf.end() || !buffers->is_array()) return;
  for (std::size_t i = 0; i < buffers->size(); ++i) {
    const nlohmann::json& buffer = (*buffers)[i];
    const auto uri = buffer.is_object() ? buffer.find("uri") : buffer.end();
    if (!buffer.is_object() || uri == buffer.end() || !uri->is_string()) continue;
    const std::string place = uri->get<std::string>();
    if (place.starts_with("data:")) continue;
    const std::filesystem::path file = place;
    const bool beside = file.is_relative() && std::find(file.begin(), file.end(), "..") == file.end();
    if (!beside || !std::filesystem::is_regular_file(std::filesystem::path(path).parent_path() / file)) {
      Refuse(path, "buffers[" + std::to_string(i) + "].uri", place,
             beside ? "there is no such file" : "is no file beside the glTF file");
    }
  }
}

/// Throws InputError for a pointer of Git LFS or git-annex, and for a web page in place of the file that it offers.
void RefuseReplacement(const std::string& path) {
  constexpr std::size_t kMarkWithin = 200;
  std::string start(kMarkWithin, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), kMarkWithin);
  RefusePointer(start, path);
  std::ranges::transform(start, start.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::size_t first = std::min(start.find_first_not_of(" \t\r\n"), start.size());
  const std::string_view text = std::string_view(start).substr(first);
  if (!text.starts_with("<!doctype html") && !text.starts_with("<html")) return;
  throw InputError({path, "", "", "is a web page, not a mesh", "download the file itself, such as by its link 'raw'"});
}

}  // namespace

void CheckMeshFile(const std::string& path) {
  RefuseReplacement(path);
  if (IsGltf(path)) CheckGltf(path);
  CheckPlyHeader(path);
  if (LooksLikeCollada(path)) CheckCollada(path);
}

namespace {

std::string Trimmed(const char* text) {
  constexpr const char* kSpace = " \t\r\n";
  const std::string word = text == nullptr ? "" : text;
  const std::size_t first = word.find_first_not_of(kSpace);
  return first == std::string::npos ? "" : word.substr(first, word.find_last_not_of(kSpace) - first + 1);
}

Eigen::Matrix3d RowsOf(const Eigen::RowVector3d& x, const Eigen::RowVector3d& y, const Eigen::RowVector3d& z) {
  Eigen::Matrix3d rows;
  rows << x, y, z;
  return rows;
}

}  // namespace

Eigen::Matrix3d RotationToZUp(const std::string& mesh_file) {
  if (IsGltf(mesh_file)) return RowsOf({1, 0, 0}, {0, 0, -1}, {0, 1, 0});  // y is up by the format
  if (!LooksLikeCollada(mesh_file)) return Eigen::Matrix3d::Identity();
  const std::string text = ReadFileText(mesh_file, kMaxMeshBytes);
  tinyxml2::XMLDocument document;
  document.Parse(text.c_str(), text.size());  // LoadMesh reports syntax errors
  const tinyxml2::XMLElement* root = document.Error() ? nullptr : document.RootElement();
  const tinyxml2::XMLElement* asset = root == nullptr ? nullptr : root->FirstChildElement("asset");
  const tinyxml2::XMLElement* up = asset == nullptr ? nullptr : asset->FirstChildElement("up_axis");
  const std::string word = up == nullptr ? "Z_UP" : Trimmed(up->GetText());
  if (word == "Z_UP") return Eigen::Matrix3d::Identity();
  if (word == "Y_UP") return RowsOf({1, 0, 0}, {0, 0, -1}, {0, 1, 0});
  if (word == "X_UP") return RowsOf({0, -1, 0}, {0, 0, -1}, {1, 0, 0});
  throw InputError({mesh_file, "line " + std::to_string(up->GetLineNum()) + ", <up_axis>", word.substr(0, 60),
                    "is no axis of COLLADA", "write X_UP, Y_UP or Z_UP"});
}

namespace {

using Eigen::Vector3d;

template <class Number>
void Put(std::ostream& stream, Number value) {
  static_assert(std::endian::native == std::endian::little, "PLY is written in the machine's order");
  stream.write(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// Returns true if the data would begin with a line end, which assimp treats as part of the header.
bool BeginsWithLineEnd(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return false;
  const auto low_byte = std::bit_cast<std::uint32_t>(static_cast<float>(mesh.vertices.front().x())) & 0xFFU;
  return low_byte == '\n' || low_byte == '\r';
}

}  // namespace

void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const bool guarded = BeginsWithLineEnd(mesh);
  ClassicOutput stream;
  stream << "ply\nformat binary_little_endian 1.0\ncomment metres, z up\nelement vertex " << mesh.vertices.size()
         << (guarded ? "\nproperty uchar guard" : "")
         << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vector3d& vertex : mesh.vertices) {
    if (guarded) Put(stream, std::uint8_t{0});
    for (int axis = 0; axis < 3; ++axis) Put(stream, static_cast<float>(vertex[axis]));
  }
  for (const auto& triangle : mesh.triangles) {
    Put(stream, static_cast<std::uint8_t>(3));
    for (const int corner : triangle) Put(stream, static_cast<std::int32_t>(corner));
  }
  WriteOutputFile(path, stream.view(), {files::kReadableByAll, files::Durability::kBuffered});
}

}  // namespace legopt
