// The whole import: it makes a dataset that loads, or throws InputError. An input is a bundle of text files: each
// begins with a line "=== PATH", and the line's end before the next one is not part of the file.
#include <algorithm>
#include <filesystem>

#include "app/isolated_call.h"
#include "legopt/dataset/dataset.h"
#include "legopt/import/importer.h"
#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

namespace fs = std::filesystem;

// Temporary folder of one input, emptied before and after.
class Workplace {
 public:
  Workplace()
      : path_(fs::path(::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp") /
              ("legopt-fuzz-import-" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_ / "in");
    fs::create_directories(path_ / "out");
  }
  ~Workplace() { fs::remove_all(path_); }
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;
  fs::path source() const { return path_ / "in"; }
  fs::path out() const { return path_ / "out"; }

 private:
  fs::path path_;
};

bool IsPlainPath(std::string_view path) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-' || c == '/';
  };
  return !path.empty() && path.size() < 100 && path.front() != '/' && path.back() != '/' &&
         path.find("..") == std::string_view::npos && std::all_of(path.begin(), path.end(), plain);
}

void WriteBundle(std::string_view text, const fs::path& folder) {
  static constexpr std::string_view kMark = "=== ";
  while (text.starts_with(kMark)) {
    const std::size_t line = std::min(text.find('\n'), text.size());
    const std::string path(text.substr(kMark.size(), line - kMark.size()));
    text.remove_prefix(std::min(line + 1, text.size()));
    const std::size_t next = std::min(text.find("\n" + std::string(kMark)), text.size());
    std::error_code error;  // a folder may have the name of a file
    if (IsPlainPath(path)) {
      fs::create_directories((folder / path).parent_path(), error);
      std::ofstream(folder / path, std::ios::binary) << text.substr(0, next);
    }
    text.remove_prefix(std::min(next + 1, text.size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Workplace place;
  WriteBundle({reinterpret_cast<const char*>(data), size}, place.source());
  legopt::ImportOptions options;
  options.source = place.source();
  options.name = "fuzz";
  options.self_collision_samples = 20;
  options.prove = size % 4 == 0;  // most of the time of an import
  options.read_guard = legopt::CallIsolated;
  try {
    const legopt::ImportReport report = legopt::ImportDataset(options, place.out());
    for (const legopt::DatasetDiagnostic& finding : report.findings) {
      legopt::fuzz::Require(!finding.check.empty(), "a finding names its check");
    }
    legopt::fuzz::Require(
        legopt::Dataset::Load(place.out(), legopt::CallIsolated)->content_hash() == report.content_hash,
        "the dataset has the reported content");
  } catch (const legopt::InputError&) {
  }
  return 0;
}
