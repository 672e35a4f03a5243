#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace legopt::client {

/// The JavaScript of the page, including styles: web/dist/page.js.
std::string_view PageProgram();

/// The HTML of a page whose script and blocks come from a server (`legopt serve`).
std::string LivePageText();

/// A self-contained HTML file: blocks, then the script. Its content security policy allows no requests.
class PageFile {
 public:
  /// `title`: window title.
  explicit PageFile(const std::string& title);
  /// Adds a block of bytes; `name` may contain letters, digits and "-".
  void AddBlock(const std::string& name, const std::string& bytes);
  /// Adds a block with the text of a JSON value.
  void AddJson(const std::string& name, const nlohmann::ordered_json& json);
  std::size_t size() const;  ///< current size of the result of Finish in bytes
  /// Returns the text of the file.
  std::string Finish() const;

 private:
  std::string head_, blocks_;
};

}  // namespace legopt::client
