#include "legopt/files/file_error.h"

#include <sys/resource.h>

#include <cerrno>
#include <system_error>

namespace legopt::files {
namespace {

// Returns the limit on file sizes as text; empty if there is none.
std::string FileSizeLimit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  return "no file may exceed " + std::to_string(limit.rlim_cur) + " bytes here; raise 'ulimit -f'";
}

}  // namespace

bool IsShortage(int error) { return error == EMFILE || error == ENFILE || error == ENOMEM; }

std::string Explain(int error) {
  const std::string text = std::generic_category().message(error);
  switch (error) {
    case EFBIG:
      return text + ": " + WriteAdvice("use another file system");
    case ENOSPC:
    case EDQUOT:
      return text + "; make room, or choose another folder";
    case EMFILE:
      return text + "; raise 'ulimit -n'";
    case ENFILE:
      return text + "; close other programs";
    case ENOENT:
      return text + "; check that the folder exists";
    case EACCES:
    case EPERM:
    case EROFS:
      return text + "; check the permissions of the file and its folder";
    case EEXIST:
      return text + "; choose another name";
    default:
      return text + "; check the path";
  }
}

std::string WriteAdvice(const std::string& usual) {
  const std::string limit = FileSizeLimit();
  return limit.empty() ? usual : limit;
}

FileError::FileError(const std::filesystem::path& path, const std::string& action, int error)
    : std::runtime_error(path.string() + ": " + action + ": " + Explain(error)),
      reason_(action + ": " + Explain(error)),
      error_(error) {}

}  // namespace legopt::files
