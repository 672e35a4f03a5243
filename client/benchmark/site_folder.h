#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace legopt::client {

/// A folder of a site. It is written beside its final place and renamed when it is complete, so that readers see the
/// former site or the new one. Not thread-safe.
class SiteFolder {
 public:
  /// Name of the file that lists all files of a site.
  static constexpr const char* kListName = "site-files.txt";

  /// `folder` must not exist, or be empty, or hold the files of a former site and nothing else: throws ClientError
  /// (kUsage) with the first other entry.
  explicit SiteFolder(const std::filesystem::path& folder);
  /// Removes the written files, unless Finish was called.
  ~SiteFolder();
  SiteFolder(const SiteFolder&) = delete;
  SiteFolder& operator=(const SiteFolder&) = delete;

  /// Writes a file; `name` is relative, with "/". Throws ClientError (kUsage) if it cannot be written.
  void Write(const std::string& name, const std::string& text);

  /// Puts the site in its place. Throws ClientError (kUsage); the former site then stays.
  void Finish();

 private:
  std::filesystem::path folder_, partial_;
  std::set<std::string> files_;
};

}  // namespace legopt::client
