#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace legopt::client {

/// The page's program, styles included: web/dist/page.js.
std::string_view PageProgram();

/// The HTML of a page whose program and blocks come from a server (`legopt serve`).
std::string LivePageText();

/// One HTML file that needs nothing else: blocks, then the program. Its content policy allows no request.
class PageFile {
 public:
  /// `title` of the window.
  explicit PageFile(const std::string& title);
  /// Adds a block of bytes; `name`: letters, digits and "-".
  void AddBlock(const std::string& name, const std::string& bytes);
  /// Adds a block with the text of a JSON value.
  void AddJson(const std::string& name, const nlohmann::ordered_json& json);
  std::size_t size() const;  ///< bytes that Finish would give now
  /// The text of the file.
  std::string Finish() const;

 private:
  std::string head_, blocks_;
};

}  // namespace legopt::client
