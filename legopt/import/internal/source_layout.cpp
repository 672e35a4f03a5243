#include "legopt/import/internal/source_layout.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <system_error>
#include <vector>

#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/import/internal/collada_document.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

using Files = std::vector<fs::path>;

/// Throws an error for a folder that cannot be listed: it might contain another robot, so that the choice would be
/// ambiguous.
[[noreturn]] void RefuseUnreadable(const fs::path& path, const std::error_code& error) {
  throw InputError({path.string(), "", "", "cannot be read: " + error.message(),
                    "allow it, or name a folder with nothing but the robot, the scene and the problems"});
}

/// Returns all regular files below the folder, sorted.
Files ListFiles(const fs::path& folder) {
  Files files;
  std::vector<fs::path> open{folder};
  while (!open.empty()) {
    const fs::path current = open.back();
    open.pop_back();
    std::error_code error;
    fs::directory_iterator entry(current, error);
    for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
      if (entry->path().filename().string().starts_with('.')) continue;
      std::error_code unknown;  // error of a dangling link, which is not a file
      const fs::file_status status = entry->status(unknown);
      if (unknown == std::errc::permission_denied) RefuseUnreadable(entry->path(), unknown);
      if (fs::is_directory(status) && !entry->is_symlink(unknown)) open.push_back(entry->path());
      if (fs::is_regular_file(status)) files.push_back(entry->path());
    }
    if (error) RefuseUnreadable(current, error);
  }
  std::sort(files.begin(), files.end());
  return files;
}

Files Select(const Files& files, const std::function<bool(const fs::path&)>& wanted) {
  Files selected;
  std::copy_if(files.begin(), files.end(), std::back_inserter(selected), wanted);
  return selected;
}

bool IsUrdf(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".urdf";
}

/// Returns true if a URDF contains a path that ends with this file name.
bool NamesFile(const std::string& urdf, const std::string& file) {
  for (const char* before : {"/", "\\", "\"", "'"}) {
    for (const char* after : {"\"", "'"}) {
      if (urdf.find(before + file + after) != std::string::npos) return true;
    }
  }
  return false;
}

class Finder {
 public:
  Finder(const fs::path& source, const SourceChoices& choices)
      : folder_(fs::is_regular_file(source) ? source.parent_path() : source), choices_(choices) {
    if (folder_ != source) {
      robot_file_ = source;
      return;
    }
    if (!fs::is_directory(folder_)) Fail("", "", "does not exist", "name a robot's file, or the folder with the files");
    files_ = ListFiles(folder_);
  }

  SourceLayout Find() {
    SourceLayout layout{.folder = folder_, .robot = {}, .scene = {}, .problems = {}};
    if (robot_file_) {
      layout.robot = RobotAlone();
      if (const auto chosen = Chosen(choices_.scene)) layout.scene = *chosen;
    } else if (fs::is_regular_file(folder_ / kDatasetFileName)) {
      const DatasetDescription description = ReadDatasetFile(folder_);
      layout.robot = Chosen(choices_.robot).value_or(folder_ / description.robot_file);
      layout.scene = Chosen(choices_.scene).value_or(folder_ / description.scene_file);
      for (const TaskDescription& task : ProblemTasks()) {
        const std::string& file = description.problem_files[task.task];
        if (!file.empty()) layout.problems[task.task] = folder_ / file;
      }
    } else {
      layout.robot = Robot();
      layout.scene = Scene(layout.robot);
      FindProblems(&layout);
    }
    for (const TaskDescription& task : ProblemTasks()) {
      fs::path& file = layout.problems[task.task];
      file = Chosen(choices_.problems[task.task]).value_or(file);
    }
    layout.collada = !IsUrdf(layout.robot);
    return layout;
  }

 private:
  [[noreturn]] void Fail(const std::string& field, const std::string& value, const std::string& message,
                         const std::string& fix) const {
    throw InputError({folder_.string(), field, value, message, fix});
  }

  std::optional<fs::path> Chosen(const std::optional<std::string>& name) const {
    if (!name) return std::nullopt;
    for (const fs::path& path : {fs::path(*name), folder_ / *name}) {
      if (fs::is_regular_file(path)) return fs::absolute(path);
    }
    throw InputError({*name, "", "", "there is no such file, here or in " + folder_.string(), "correct the path"});
  }

  std::string Names(const Files& files) const {
    std::string names;
    for (const fs::path& file : files) names += (names.empty() ? "" : ", ") + file.lexically_relative(folder_).string();
    return names;
  }

  fs::path TheOnly(const Files& found, const std::string& what, const std::string& flag) const {
    if (found.size() == 1) return found.front();
    Fail(what, Names(found), found.empty() ? "there is none" : "there are several", "name it with " + flag + " FILE");
  }

  fs::path RobotAlone() const {
    if (!IsUrdf(*robot_file_) && !IsColladaRobot(*robot_file_)) {
      throw InputError({robot_file_->string(), "", "", "is not a robot (*.urdf, or *.zae or *.dae with kinematics)",
                        "name a robot's file, or the folder with the files"});
    }
    if (choices_.robot) {
      throw InputError({robot_file_->string(), "--robot", *choices_.robot, "is a second robot",
                        "name the folder with the files and --robot, or one robot's file"});
    }
    return *robot_file_;
  }

  fs::path Robot() const {
    if (const auto chosen = Chosen(choices_.robot)) return *chosen;
    const Files urdfs = Select(files_, IsUrdf);
    if (!urdfs.empty()) return TheOnly(urdfs, "robot (*.urdf)", "--robot");
    return TheOnly(Select(files_, IsColladaRobot), "robot (*.urdf, or *.zae or *.dae with kinematics)", "--robot");
  }

  fs::path Scene(const fs::path& robot) const {
    if (const auto chosen = Chosen(choices_.scene)) return *chosen;
    if (const auto named = SceneOfEnvironment()) return *named;
    if (fs::is_regular_file(folder_ / "scene.yaml")) return folder_ / "scene.yaml";
    const std::string description = IsUrdf(robot) ? ReadUrdfFile(robot.string()) : "";  // names its own meshes
    const Files meshes = Select(files_, [&](const fs::path& file) {
      return file.parent_path() == folder_ && file != robot && IsMeshFile(file) && !IsColladaRobot(file) &&
             !NamesFile(description, file.filename().string());
    });
    if (meshes.empty()) return {};
    return TheOnly(meshes, "scene (scene.yaml, or .stl .obj .dae .ply in the folder itself)", "--scene");
  }

  /// Returns the mesh that is rendered by an OpenRAVE environment in the folder.
  std::optional<fs::path> SceneOfEnvironment() const {
    for (const fs::path& file : files_) {
      if (file.parent_path() != folder_ || file.extension() != ".xml") continue;
      tinyxml2::XMLDocument document;
      if (document.LoadFile(file.string().c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr ||
          document.RootElement()->Name() != std::string_view("Environment")) {
        continue;
      }
      const tinyxml2::XMLElement* render = ColladaDocument::FindFirst(*document.RootElement(), "Render");
      if (render == nullptr || render->GetText() == nullptr) continue;
      std::string name;
      ClassicInput(render->GetText()) >> name;  // a scale may follow
      if (fs::is_regular_file(folder_ / name)) return folder_ / name;
      throw InputError({file.string(), "<Render>", name, "the scene that the environment shows does not exist",
                        "fetch it with 'git submodule update --init', or name another with --scene FILE"});
    }
    return std::nullopt;
  }

  void FindProblems(SourceLayout* layout) const {
    const Files files = Select(files_, [](const fs::path& file) {
      return file.extension() == ".json" && file.filename().string().starts_with("problems");
    });
    for (const fs::path& file : files) {
      const Task task = TaskOfProblems(file);
      if (choices_.problems[task]) continue;
      fs::path& place = layout->problems[task];
      if (!place.empty()) {
        const std::string word(ToString(task));
        Fail(word + " problems", Names({place, file}), "there are several files", "name one with --" + word + " FILE");
      }
      place = file;
    }
  }

  /// Returns the task of a problem file. An empty file without a task has that of its name.
  static Task TaskOfProblems(const fs::path& file) {
    const ProblemFile problems = ReadProblemFile(file);
    Task task = TaskOf(problems);
    if (problems.task || !problems.problems.empty()) return task;
    for (const TaskDescription& named : ProblemTasks()) {
      if (file.filename().string().find(ToString(named.task)) != std::string::npos) task = named.task;
    }
    return task;
  }

  fs::path folder_;
  std::optional<fs::path> robot_file_;  ///< the source, if it is a file
  const SourceChoices& choices_;
  Files files_;
};

}  // namespace

SourceLayout FindSources(const fs::path& source, const SourceChoices& choices) {
  // A file that is a symbolic link keeps its place: its meshes are beside the link.
  const fs::path whole = fs::is_regular_file(source)
                             ? fs::weakly_canonical(fs::absolute(source).parent_path()) / source.filename()
                             : fs::weakly_canonical(source);
  return Finder(whole, choices).Find();
}

}  // namespace legopt
