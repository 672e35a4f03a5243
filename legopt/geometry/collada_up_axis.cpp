#include "legopt/geometry/collada_up_axis.h"

#include <tinyxml2.h>

#include "legopt/geometry/mesh_file_check.h"
#include "legopt/input/file_text.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

constexpr std::size_t kMaxColladaBytes = std::size_t{1} << 30;

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
  if (!LooksLikeCollada(mesh_file)) return Eigen::Matrix3d::Identity();
  const std::string text = ReadFileText(mesh_file, kMaxColladaBytes);
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

}  // namespace legopt
