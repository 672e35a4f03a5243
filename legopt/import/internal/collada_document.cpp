#include "legopt/import/internal/collada_document.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <memory>

#include "legopt/import/internal/degree.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr const char* kSpace = " \t\r\n";

std::string LowerSuffix(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

[[noreturn]] void Refuse(const fs::path& path, const std::string& field, const std::string& value,
                         const std::string& message, const std::string& fix) {
  throw InputError({path.string(), field, value, message, fix});
}

std::string ReadFile(const fs::path& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 30;
  return ReadFileText(path, kMostBytes);
}

struct CloseArchive {
  void operator()(void* archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<void, CloseArchive>;

/// Reads all bytes of the archive's current file. Does not trust the size in the header, so that memory grows only with
/// the actual content.
std::string Unpack(const fs::path& path, void* archive, const std::string& name) {
  constexpr size_t kMaxBytes = size_t{1} << 30;
  constexpr size_t kBlock_bytes = size_t{1} << 16;
  std::string text;
  int count = unzOpenCurrentFile(archive) == UNZ_OK ? 1 : -1;
  while (count > 0 && text.size() < kMaxBytes) {
    const size_t before = text.size();
    text.resize(before + kBlock_bytes);
    count = unzReadCurrentFile(archive, text.data() + before, static_cast<unsigned>(kBlock_bytes));
    text.resize(before + static_cast<size_t>(std::max(count, 0)));
  }
  if (unzCloseCurrentFile(archive) != UNZ_OK || count != 0) {  // closing compares the checksum
    Refuse(path, name, std::to_string(text.size()) + " bytes", "cannot be unpacked", "pack the archive again");
  }
  return text;
}

/// Returns the only COLLADA document of a zip archive.
std::string ReadArchive(const fs::path& path) {
  ReadFile(path);  // reports a missing file, before unzOpen reports a wrong format
  const Archive archive(unzOpen(path.c_str()));
  if (archive == nullptr) Refuse(path, "", "", "is not a zip archive", "give the .dae file itself");
  std::string text;
  int documents = 0;
  for (int state = unzGoToFirstFile(archive.get()); state == UNZ_OK; state = unzGoToNextFile(archive.get())) {
    std::array<char, 1024> name{};
    unz_file_info info{};  // minizip writes into it unconditionally
    unzGetCurrentFileInfo(archive.get(), &info, name.data(), name.size() - 1, nullptr, 0, nullptr, 0);
    if (LowerSuffix(name.data()) != ".dae") continue;
    if (++documents == 1) text = Unpack(path, archive.get(), name.data());
  }
  if (documents == 1) return text;
  Refuse(path, "*.dae", std::to_string(documents), "a robot's archive holds one COLLADA document",
         "unpack it and name the robot's .dae file");
}

void CollectAll(const XMLElement& root, std::string_view name, std::vector<const XMLElement*>* found) {
  for (const XMLElement* e = root.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (e->Name() == name) {
      found->push_back(e);
    } else {
      CollectAll(*e, name, found);
    }
  }
}

/// Returns the child <name> of the parent, or the <wrapper> inside it.
const XMLElement* Wrapped(const XMLElement& parent, const char* name, const char* wrapper) {
  const XMLElement* element = parent.FirstChildElement(name);
  if (element == nullptr) return nullptr;
  const XMLElement* inner = element->FirstChildElement(wrapper);
  return inner != nullptr ? inner : element;
}

}  // namespace

ColladaDocument::ColladaDocument(const fs::path& path) : path_(path) {
  const std::string text = LowerSuffix(path) == ".zae" ? ReadArchive(path) : ReadFile(path);
  if (document_.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
    Refuse(path_, "line " + std::to_string(document_.ErrorLineNum()), "",
           std::string("not valid XML: ") + document_.ErrorName(), "correct the file");
  }
  if (document_.RootElement() == nullptr || document_.RootElement()->Name() != std::string_view("COLLADA")) {
    Refuse(path_, "<COLLADA>", "", "is not a COLLADA file", "give a .dae or .zae file with kinematics");
  }
  const XMLElement* asset = root().FirstChildElement("asset");
  if (asset == nullptr) return;
  const XMLElement* up = asset->FirstChildElement("up_axis");
  // The format's default is Y_UP, but robots without this element were written by hand with z up.
  if (up != nullptr && up->GetText() != nullptr && std::string_view(up->GetText()).find("Z_UP") == std::string::npos) {
    Fail(*up, up->GetText(), "another axis than z points up", "export the robot again with z up");
  }
  const XMLElement* unit = asset->FirstChildElement("unit");
  if (unit == nullptr) return;
  const char* meter = unit->Attribute("meter");
  if (meter == nullptr) return;
  unit_m_ = ParseNumber(meter).value_or(0.0);
  if (!(unit_m_ > 0.0) || !std::isfinite(unit_m_)) {
    Fail(*unit, meter, "the unit of length must be a positive number", "write meter=\"1\"");
  }
}

std::vector<const XMLElement*> ColladaDocument::FindAll(const XMLElement& root, const char* name) {
  std::vector<const XMLElement*> found;
  CollectAll(root, name, &found);
  return found;
}

const XMLElement* ColladaDocument::FindFirst(const XMLElement& root, const char* name) {
  const auto found = FindAll(root, name);
  return found.empty() ? nullptr : found.front();
}

void ColladaDocument::Fail(const XMLElement& element, const std::string& value, const std::string& message,
                           const std::string& fix) const {
  Refuse(path_, "line " + std::to_string(element.GetLineNum()) + ", <" + element.Name() + ">", value, message, fix);
}

std::string ColladaDocument::Attribute(const XMLElement& element, const char* name) const {
  const char* value = element.Attribute(name);
  if (value == nullptr || *value == '\0') {
    Fail(element, "", "the attribute '" + std::string(name) + "' is missing", "add it, or export the file again");
  }
  return value;
}

std::vector<double> ColladaDocument::Numbers(const XMLElement& element, int count) const {
  std::vector<double> numbers;
  const std::string_view text = element.GetText() != nullptr ? element.GetText() : "";
  for (size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
    const std::string_view token = text.substr(begin, end - begin);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (error != std::errc() || stop != token.data() + token.size() || !std::isfinite(value)) {
      Fail(element, std::string(token), "is not a finite number", "correct it");
    }
    numbers.push_back(value);
    begin = text.find_first_not_of(kSpace, end);
  }
  if (count >= 0 && std::ssize(numbers) != count) {
    Fail(element, std::to_string(numbers.size()) + " numbers", "needs " + std::to_string(count) + " numbers",
         "correct it");
  }
  return numbers;
}

double ColladaDocument::Number(const XMLElement& parent, const char* name, double fallback) const {
  const XMLElement* element = Wrapped(parent, name, "float");
  return element == nullptr ? fallback : Numbers(*element, 1).front();
}

bool ColladaDocument::Flag(const XMLElement& parent, const char* name, bool fallback) const {
  const XMLElement* element = Wrapped(parent, name, "bool");
  if (element == nullptr) return fallback;
  bool value = false;
  if (element->QueryBoolText(&value) != tinyxml2::XML_SUCCESS) {
    Fail(*element, element->GetText() != nullptr ? element->GetText() : "", "is neither true nor false", "correct it");
  }
  return value;
}

Eigen::Isometry3d ColladaDocument::Transform(const XMLElement& element) const {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view name = e->Name();
    if (name == "translate") {
      const std::vector<double> t = Numbers(*e, 3);
      transform.translate(unit_m_ * Eigen::Vector3d(t[0], t[1], t[2]));
    } else if (name == "rotate") {
      const std::vector<double> r = Numbers(*e, 4);
      const Eigen::Vector3d axis(r[0], r[1], r[2]);
      if (r[3] == 0.0) continue;  // also for a fixed joint, whose axis is zero
      if (!(axis.norm() > 0.0)) Fail(*e, "", "the axis of rotation has no length", "correct it");
      transform.rotate(Eigen::AngleAxisd(kDegree * r[3], axis.normalized()));
    } else if (name == "matrix") {
      const std::vector<double> m = Numbers(*e, 16);
      Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
      step.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
      constexpr double kRounding = 1e-4;
      const bool rotation =
          (step.linear() * step.linear().transpose()).isIdentity(kRounding) && step.linear().determinant() > 0.0;
      if (!rotation) {
        Fail(*e, "", "is not a rotation and a translation", "apply the scale to the meshes and export again");
      }
      transform.translate(unit_m_ * step.translation());
      transform.rotate(Eigen::Quaterniond(step.linear()).normalized());
    } else if (name == "scale" || name == "skew" || name == "lookat") {
      Fail(*e, "", "only translate, rotate and matrix can be read here", "apply it to the meshes and export again");
    }
  }
  return transform;
}

bool IsColladaRobot(const fs::path& path) {
  const std::string suffix = LowerSuffix(path);
  if (suffix == ".zae") return true;
  return suffix == ".dae" && ReadFile(path).find("<kinematics_model") != std::string::npos;
}

std::string_view LastPart(std::string_view reference) {
  const size_t separator = reference.find_last_of("#/");
  return separator == std::string_view::npos ? reference : reference.substr(separator + 1);
}

namespace {

constexpr const char* kExportAgain = "export the file again";

const XMLElement* ChildById(const XMLElement& parent, const char* name, std::string_view id) {
  for (const XMLElement* e = parent.FirstChildElement(name); e != nullptr; e = e->NextSiblingElement(name)) {
    const char* own = e->Attribute("id");
    if (own != nullptr && id == own) return e;
  }
  return nullptr;
}

/// Returns the <input> with the given semantic, or null.
const XMLElement* FindInput(const XMLElement& parent, std::string_view semantic) {
  for (const XMLElement* e = parent.FirstChildElement("input"); e != nullptr; e = e->NextSiblingElement("input")) {
    const char* own = e->Attribute("semantic");
    if (own != nullptr && semantic == own) return e;
  }
  return nullptr;
}

/// Reads the points of a <mesh>. Its <vertices> is searched only inside the mesh, since urdf_to_collada gives all of
/// them the same id.
std::vector<Eigen::Vector3d> ReadPoints(const ColladaDocument& document, const XMLElement& mesh) {
  const XMLElement* vertices = mesh.FirstChildElement("vertices");
  if (vertices == nullptr) document.Fail(mesh, "", "has no <vertices>", kExportAgain);
  const XMLElement* input = FindInput(*vertices, "POSITION");
  if (input == nullptr) document.Fail(*vertices, "", "has no input POSITION", kExportAgain);
  const std::string source_id = document.Attribute(*input, "source");
  const XMLElement* source = ChildById(mesh, "source", LastPart(source_id));
  const XMLElement* array = source != nullptr ? source->FirstChildElement("float_array") : nullptr;
  if (array == nullptr) document.Fail(*input, source_id, "there is no such source of numbers", kExportAgain);
  const XMLElement* accessor = ColladaDocument::FindFirst(*source, "accessor");
  const int stride = accessor != nullptr ? accessor->IntAttribute("stride", 3) : 3;
  const std::vector<double> numbers = document.Numbers(*array, -1);
  if (stride < 3 || numbers.size() % static_cast<size_t>(stride) != 0) {
    document.Fail(*array, std::to_string(numbers.size()) + " numbers", "does not hold whole points", kExportAgain);
  }
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < numbers.size(); i += static_cast<size_t>(stride)) {
    points.push_back(document.unit_m() * Eigen::Vector3d(numbers[i], numbers[i + 1], numbers[i + 2]));
  }
  return points;
}

/// Returns the number of corners per face of a <polylist>; empty for <triangles>, with three each.
std::vector<int> ReadCounts(const ColladaDocument& document, const XMLElement& primitive) {
  std::vector<int> counts;
  const XMLElement* list = primitive.FirstChildElement("vcount");
  if (list == nullptr) return counts;
  for (const double value : document.Numbers(*list, -1)) counts.push_back(static_cast<int>(value));
  return counts;
}

/// Adds the faces of one <triangles> or <polylist>, split into triangle fans.
void AddFaces(const ColladaDocument& document, const XMLElement& primitive, TriangleMesh* mesh) {
  const XMLElement* vertex_input = FindInput(primitive, "VERTEX");
  const XMLElement* list = primitive.FirstChildElement("p");
  if (vertex_input == nullptr || list == nullptr) return;  // an empty primitive
  int stride = 1;
  for (const XMLElement* e = primitive.FirstChildElement("input"); e != nullptr; e = e->NextSiblingElement("input")) {
    stride = std::max(stride, e->IntAttribute("offset", 0) + 1);
  }
  const int offset = vertex_input->IntAttribute("offset", 0);
  const std::vector<double> numbers = document.Numbers(*list, -1);
  std::vector<int> corners;
  for (size_t i = 0; offset >= 0 && i + static_cast<size_t>(stride) <= numbers.size();
       i += static_cast<size_t>(stride)) {
    const double index = numbers[i + static_cast<size_t>(offset)];
    if (!(index >= 0.0 && index < static_cast<double>(mesh->vertices.size()))) {
      document.Fail(*list, std::to_string(index), "there is no such vertex", kExportAgain);
    }
    corners.push_back(static_cast<int>(index));
  }
  std::vector<int> counts = ReadCounts(document, primitive);
  if (counts.empty()) counts.assign(corners.size() / 3, 3);
  size_t begin = 0;
  for (const int count : counts) {
    const size_t end = begin + static_cast<size_t>(std::max(count, 0));
    if (end > corners.size()) document.Fail(*list, "", "has fewer corners than its faces need", kExportAgain);
    for (size_t k = begin + 1; k + 1 < end; ++k) {
      mesh->triangles.push_back({corners[begin], corners[k], corners[k + 1]});
    }
    begin = end;
  }
}

}  // namespace

ColladaScene::ColladaScene(const ColladaDocument& document, const std::vector<std::string>& link_names,
                           const std::string& base)
    : document_(document), base_name_(base) {
  for (const std::string& name : link_names) instances_[name];
  for (const XMLElement* e : ColladaDocument::FindAll(document.root(), "geometry")) {
    geometries_[document.Attribute(*e, "id")] = e;
  }
  const XMLElement* scene = ColladaDocument::FindFirst(document.root(), "visual_scene");
  if (scene == nullptr) {
    document.Fail(document.root(), "", "there is no <visual_scene>, so that the links have no shape", kExportAgain);
  }
  for (const XMLElement* e = scene->FirstChildElement("node"); e != nullptr; e = e->NextSiblingElement("node")) {
    Visit(*e, Eigen::Isometry3d::Identity(), "");
  }
  if (!base_found_) {
    document.Fail(*scene, base, "no node has the name of the base link", "give nodes the names of their links");
  }
}

void ColladaScene::Visit(const XMLElement& node, const Eigen::Isometry3d& parent, const std::string& owner) {
  const char* name = node.Attribute("name");
  const bool is_link = name != nullptr && instances_.contains(name);
  const std::string link = is_link ? name : owner;
  if (link == base_name_ && !base_found_) {
    base_ = parent;
    base_found_ = true;
  }
  const Eigen::Isometry3d pose = parent * document_.Transform(node);
  for (const XMLElement* e = node.FirstChildElement("instance_geometry"); e != nullptr && !link.empty();
       e = e->NextSiblingElement("instance_geometry")) {
    const std::string url = document_.Attribute(*e, "url");
    const auto geometry = geometries_.find(std::string(LastPart(url)));
    if (geometry == geometries_.end()) document_.Fail(*e, url, "there is no such geometry", kExportAgain);
    instances_[link].push_back({geometry->second, pose});
  }
  for (const XMLElement* e = node.FirstChildElement("node"); e != nullptr; e = e->NextSiblingElement("node")) {
    Visit(*e, pose, link);
  }
}

TriangleMesh ColladaScene::MeshOf(const XMLElement& geometry) const {
  const XMLElement* mesh = geometry.FirstChildElement("mesh");
  if (mesh == nullptr) document_.Fail(geometry, "", "holds no <mesh>", kExportAgain);
  TriangleMesh result;
  result.vertices = ReadPoints(document_, *mesh);
  for (const XMLElement* e = mesh->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view name = e->Name();
    if (name == "triangles" || name == "polylist") AddFaces(document_, *e, &result);
  }
  if (result.triangles.empty()) document_.Fail(*mesh, "", "has neither <triangles> nor <polylist>", kExportAgain);
  return result;
}

std::vector<ColladaGeometry> ColladaScene::GeometryOf(const std::string& name, const Eigen::Isometry3d& link) const {
  std::vector<ColladaGeometry> result;
  for (const Instance& instance : instances_.at(name)) {
    ColladaGeometry& geometry = result.emplace_back();
    geometry.mesh = MeshOf(*instance.geometry);
    geometry.pose = link.inverse() * base_.inverse() * instance.pose;
  }
  return result;
}

}  // namespace legopt
