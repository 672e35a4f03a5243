#include "legopt/import/collada_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using tinyxml2::XMLElement;

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
