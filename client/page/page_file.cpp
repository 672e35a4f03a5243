#include "client/page/page_file.h"

#include <zlib.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>

#include "legopt/input/json.h"

namespace legopt::client {
namespace {

static_assert(std::endian::native == std::endian::little, "blocks are copied as they lie in memory");

constexpr double kUnit = 1e-7, kLargest = 100.0, kLargestStep = 200.0;
constexpr std::size_t kHead = 8, kBytes = 4;

template <class Number>
void AppendNumber(Number number, std::string* bytes) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &number, sizeof(Number));
  bytes->append(raw.data(), raw.size());
}

std::string BlockHead(std::span<const Eigen::VectorXd> waypoints) {
  std::string bytes;
  AppendNumber(static_cast<std::uint32_t>(waypoints.size()), &bytes);
  AppendNumber(static_cast<std::uint32_t>(waypoints.empty() ? 0 : waypoints.front().size()), &bytes);
  return bytes;
}

}  // namespace

std::string Gzip(const std::string& bytes) {
  constexpr int kGzipWindow = 15 + 16, kMemory = 9;
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::size_t kGroup = 3;
  constexpr unsigned kByte = 8, kSix = 6, kMask = 63;
  std::string text;
  text.reserve((bytes.size() + 2) / kGroup * 4);
  for (std::size_t i = 0; i < bytes.size(); i += kGroup) {
    unsigned group = 0;
    for (std::size_t k = 0; k < kGroup; ++k) {
      group = (group << kByte) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k <= kGroup; ++k) {
      const bool padding = i + k > bytes.size();
      text += padding ? '=' : kDigits[(group >> (kSix * (kGroup - k))) & kMask];
    }
  }
  return text;
}

std::string PackWaypoints(std::span<const Eigen::VectorXd> waypoints) {
  std::string bytes = BlockHead(waypoints);
  if (waypoints.empty()) return bytes;
  std::array<std::string, kBytes> planes;
  for (Eigen::Index column = 0; column < waypoints.front().size(); ++column) {
    std::int64_t before = 0;
    for (const Eigen::VectorXd& x : waypoints) {
      const double value = x[column];
      if (!std::isfinite(value) || std::abs(value) > kLargest) return {};
      const std::int64_t now = std::llround(value / kUnit), difference = now - before;
      if (std::abs(static_cast<double>(difference)) * kUnit > kLargestStep) return {};
      const auto word = static_cast<std::uint32_t>(static_cast<std::int32_t>(difference));
      for (std::size_t k = 0; k < kBytes; ++k) planes[k] += static_cast<char>((word >> (8 * k)) & 255U);
      before = now;
    }
  }
  for (const std::string& plane : planes) bytes += plane;
  return bytes;
}

std::string PackExactly(std::span<const Eigen::VectorXd> waypoints) {
  std::string bytes = BlockHead(waypoints);
  for (const Eigen::VectorXd& x : waypoints) {
    for (const double value : x) AppendNumber(value, &bytes);
  }
  return bytes;
}

std::vector<Eigen::VectorXd> UnpackWaypoints(const std::string& bytes) {
  std::uint32_t count = 0, size = 0;
  if (bytes.size() < kHead) return {};
  std::memcpy(&count, bytes.data(), sizeof(count));
  std::memcpy(&size, bytes.data() + sizeof(count), sizeof(size));
  const std::size_t values = std::size_t{count} * size;
  if (bytes.size() != kHead + values * kBytes) return {};
  std::vector<Eigen::VectorXd> waypoints(count, Eigen::VectorXd(static_cast<Eigen::Index>(size)));
  for (std::size_t column = 0; column < size; ++column) {
    std::int64_t sum = 0;
    for (std::size_t w = 0; w < count; ++w) {
      std::uint32_t word = 0;
      for (std::size_t k = 0; k < kBytes; ++k) {
        const auto byte = static_cast<unsigned char>(bytes[kHead + k * values + column * count + w]);
        word |= static_cast<std::uint32_t>(byte) << (8 * k);
      }
      sum += static_cast<std::int32_t>(word);
      waypoints[w][static_cast<Eigen::Index>(column)] = static_cast<double>(sum) * kUnit;
    }
  }
  return waypoints;
}

int GeometryBlock::Add(const TriangleMesh& mesh) {
  MeshRange range{.vertices = mesh.vertices.size(), .triangles = mesh.triangles.size(), .vertex_offset = bytes_.size()};
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    for (const double value : vertex) AppendNumber(static_cast<float>(value), &bytes_);
  }
  range.index_offset = bytes_.size();
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) AppendNumber(static_cast<std::uint32_t>(corner), &bytes_);
  }
  meshes_.push_back(range);
  return static_cast<int>(meshes_.size()) - 1;
}

namespace {

// The content security policy. `scripts`: sources of scripts besides those inside the page.
std::string Policy(const std::string& scripts) {
  return "default-src 'none'; script-src 'unsafe-inline'" + scripts +
         "; style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; "
         "base-uri 'none'; "
         "form-action 'none'";
}

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

PageFile::PageFile(const std::string& title, PageKind kind)
    : head_(Head("", Policy(kind == PageKind::kOpener ? " 'wasm-unsafe-eval'" : ""), title)), kind_(kind) {}

void PageFile::AddBlock(const std::string& name, const std::string& bytes) {
  blocks_ += "<script type=\"application/octet-stream\" id=\"" + name + "\">" + Base64(Gzip(bytes)) + "</script>\n";
}

void PageFile::AddJson(const std::string& name, const nlohmann::ordered_json& json) { AddBlock(name, Dump(json)); }

std::string LivePageText() {
  return Head(" data-live=\"\"", "", "legopt") + kBody + "<script src=\"page.js\"></script></body></html>\n";
}

std::size_t PageFile::size() const {
  const std::size_t opener = kind_ == PageKind::kOpener ? OpenerProgram().size() : 0;
  return head_.size() + blocks_.size() + opener + PageProgram().size();
}

std::string PageFile::Finish() const {
  const std::string opener =
      kind_ == PageKind::kOpener ? "<script>" + std::string(OpenerProgram()) + "</script>\n" : "";
  return head_ + kBody + blocks_ + opener + "<script>" + std::string(PageProgram()) + "</script></body></html>\n";
}

}  // namespace legopt::client
