#include "client/page/page_file.h"

#include "client/page/page_block.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

constexpr char kPolicy[] =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; "
    "form-action 'none'";

constexpr char kBody[] =
    "<body><div id=\"app\"><p>This page draws itself by JavaScript, which is switched off here. "
    "<code>legopt table</code> prints the same figures.</p></div>\n";

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

// `policy`: empty if a server sends it as a header.
std::string Head(const std::string& attributes, const std::string& policy, const std::string& title) {
  std::string head = "<!doctype html>\n<html lang=\"en\"" + attributes + "><head><meta charset=\"utf-8\">\n";
  if (!policy.empty()) head += "<meta http-equiv=\"Content-Security-Policy\" content=\"" + policy + "\">\n";
  return head +
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<link rel=\"icon\" href=\"data:,\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>" +
         Escaped(title) + "</title></head>\n";
}

}  // namespace

PageFile::PageFile(const std::string& title) : head_(Head("", kPolicy, title)) {}

void PageFile::AddBlock(const std::string& name, const std::string& bytes) {
  blocks_ += "<script type=\"application/octet-stream\" id=\"" + name + "\">" + Base64(Gzip(bytes)) + "</script>\n";
}

void PageFile::AddJson(const std::string& name, const nlohmann::ordered_json& json) { AddBlock(name, Dump(json)); }

std::string LivePageText() {
  return Head(" data-live=\"\"", "", "legopt") + kBody + "<script src=\"page.js\"></script></body></html>\n";
}

std::size_t PageFile::size() const { return head_.size() + blocks_.size() + PageProgram().size(); }

std::string PageFile::Finish() const {
  return head_ + kBody + blocks_ + "<script>" + std::string(PageProgram()) + "</script></body></html>\n";
}

}  // namespace legopt::client
