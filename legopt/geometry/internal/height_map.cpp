#include "legopt/geometry/internal/height_map.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr int kMaxSamples = 2049;
constexpr std::size_t kMaxHeightMapBytes = std::size_t{1} << 28;

[[noreturn]] void RefuseHeights(const std::string& path, const std::string& field, const std::string& value,
                                const std::string& message, const std::string& fix) {
  throw InputError({path, field, value, message, fix});
}

void CheckGridSize(const std::string& path, std::int64_t columns, std::int64_t rows) {
  if (std::min(columns, rows) >= 2 && std::max(columns, rows) <= kMaxSamples) return;
  RefuseHeights(path, "size", std::to_string(columns) + " x " + std::to_string(rows),
                "a height map has from 2 x 2 to 2049 x 2049 values", "scale the picture or thin out the grid");
}

std::string SuffixOf(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix;
}

/// Bytes of a PNG file that libpng reads from memory, and its rows.
struct PngDecoder {
  std::string_view bytes;
  std::size_t position = 0;
  png_structp png = nullptr;
  png_infop info = nullptr;
  png_uint_32 columns = 0;
  png_uint_32 rows = 0;
  int depth_bits = 0;
  std::vector<std::uint8_t> pixels;

  PngDecoder() = default;
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;
  ~PngDecoder() { png_destroy_read_struct(&png, &info, nullptr); }
};

void ReadPngBytes(png_structp png, png_bytep target, std::size_t count) {
  auto* decoder = static_cast<PngDecoder*>(png_get_io_ptr(png));
  if (count > decoder->bytes.size() - decoder->position) png_error(png, "the file ends early");
  std::copy_n(decoder->bytes.begin() + static_cast<std::ptrdiff_t>(decoder->position), count, target);
  decoder->position += count;
}

void IgnorePngWarning(png_structp /*png*/, png_const_charp /*text*/) {}

// libpng reports errors by longjmp. No object with a destructor lives in these two functions.
bool ReadPngHeader(PngDecoder* decoder) {
  if (setjmp(png_jmpbuf(decoder->png))) return false;  // NOLINT: the interface of libpng
  png_set_read_fn(decoder->png, decoder, ReadPngBytes);
  png_read_info(decoder->png, decoder->info);
  decoder->columns = png_get_image_width(decoder->png, decoder->info);
  decoder->rows = png_get_image_height(decoder->png, decoder->info);
  return true;
}

bool ReadPngPixels(PngDecoder* decoder) {
  if (setjmp(png_jmpbuf(decoder->png))) return false;  // NOLINT: the interface of libpng
  const int colour = png_get_color_type(decoder->png, decoder->info);
  if (colour == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(decoder->png);
  if (colour == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(decoder->png);
  png_set_strip_alpha(decoder->png);
  constexpr int kSilently = 1, kDefaultWeight = -1;
  if ((colour & PNG_COLOR_MASK_COLOR) != 0) {
    png_set_rgb_to_gray_fixed(decoder->png, kSilently, kDefaultWeight, kDefaultWeight);
  }
  const int passes = png_set_interlace_handling(decoder->png);
  png_read_update_info(decoder->png, decoder->info);
  decoder->depth_bits = png_get_bit_depth(decoder->png, decoder->info);
  const std::size_t stride = png_get_rowbytes(decoder->png, decoder->info);
  if (stride != decoder->pixels.size() / decoder->rows * static_cast<std::size_t>(decoder->depth_bits) / 16) {
    png_error(decoder->png, "unexpected length of rows");
  }
  for (int pass = 0; pass < passes; ++pass) {
    for (png_uint_32 row = 0; row < decoder->rows; ++row) {
      png_read_row(decoder->png, decoder->pixels.data() + row * stride, nullptr);
    }
  }
  return true;
}

HeightGrid ReadPng(const std::string& path, const std::string& bytes) {
  PngDecoder decoder;
  decoder.bytes = bytes;
  decoder.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, IgnorePngWarning);
  if (decoder.png == nullptr) throw std::bad_alloc();
  png_set_error_fn(
      decoder.png, nullptr, [](png_structp png, png_const_charp) { png_longjmp(png, 1); }, IgnorePngWarning);
  decoder.info = png_create_info_struct(decoder.png);
  if (decoder.info == nullptr) throw std::bad_alloc();
  const bool header = ReadPngHeader(&decoder);
  if (header) {
    CheckGridSize(path, decoder.columns, decoder.rows);
    decoder.pixels.resize(std::size_t{2} * decoder.columns * decoder.rows);
  }
  if (!header || !ReadPngPixels(&decoder)) {
    RefuseHeights(path, "", "", "is no PNG picture, or it is damaged", "save the picture again as greyscale PNG");
  }
  HeightGrid grid{static_cast<int>(decoder.columns), static_cast<int>(decoder.rows), {}};
  constexpr double kMax8 = 255.0, kMax16 = 65535.0;
  for (std::size_t i = 0; i < std::size_t{decoder.columns} * decoder.rows; ++i) {
    if (decoder.depth_bits == 16) {
      grid.heights_m.push_back((256.0 * decoder.pixels[2 * i] + decoder.pixels[2 * i + 1]) / kMax16);
    } else {
      grid.heights_m.push_back(decoder.pixels[i] / kMax8);
    }
  }
  return grid;
}

/// Reads the header of a PGM file, with its comments, and the values of both forms.
class PgmReader {
 public:
  PgmReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  HeightGrid Read() {
    if (!bytes_.starts_with("P2") && !bytes_.starts_with("P5")) Damaged("does not begin with P2 or P5");
    const bool plain = bytes_[1] == '2';
    position_ = 2;
    const int columns = Number(), rows = Number(), most = Number();
    CheckGridSize(path_, columns, rows);
    if (most < 1 || most > std::numeric_limits<std::uint16_t>::max()) Damaged("its largest value is not 1 to 65535");
    HeightGrid grid{columns, rows, {}};
    const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    const std::size_t width = most > std::numeric_limits<std::uint8_t>::max() ? 2 : 1;
    ++position_;  // one space follows the header
    if (!plain && (position_ > bytes_.size() || bytes_.size() - position_ < count * width)) Damaged("it ends early");
    for (std::size_t i = 0; i < count; ++i) {
      int value = 0;
      if (plain) {
        value = Number();
      } else {
        for (std::size_t k = 0; k < width; ++k) value = 256 * value + static_cast<unsigned char>(bytes_[position_++]);
      }
      if (value > most) Damaged("a value is larger than its largest value");
      grid.heights_m.push_back(static_cast<double>(value) / most);
    }
    return grid;
  }

 private:
  [[noreturn]] void Damaged(const std::string& reason) const {
    RefuseHeights(path_, "byte " + std::to_string(position_), "", "is no PGM picture: " + reason,
                  "save the picture again as greyscale PGM or PNG");
  }

  int Number() {
    const auto at_end = [&] { return position_ >= bytes_.size(); };
    while (!at_end() &&
           (std::isspace(static_cast<unsigned char>(bytes_[position_])) != 0 || bytes_[position_] == '#')) {
      if (bytes_[position_] == '#') {
        while (!at_end() && bytes_[position_] != '\n') ++position_;
      } else {
        ++position_;
      }
    }
    constexpr int kMost = 1'000'000;
    int value = 0;
    const std::size_t first = position_;
    while (!at_end() && std::isdigit(static_cast<unsigned char>(bytes_[position_])) != 0 && value < kMost) {
      value = 10 * value + (bytes_[position_++] - '0');
    }
    if (position_ == first) Damaged(at_end() ? "it ends early" : "a number is missing");
    return value;
  }

  const std::string& path_;
  std::string_view bytes_;
  std::size_t position_ = 0;
};

HeightGrid ReadNumbers(const std::string& path, const std::string& text) {
  HeightGrid grid;
  std::string word;
  int line = 1, columns = 0;
  const auto end_word = [&] {
    if (word.empty()) return;
    const std::optional<double> value = ParseNumber(word);
    if (!value || !std::isfinite(*value)) {
      RefuseHeights(path, "line " + std::to_string(line), word.substr(0, 60), "is no finite number",
                    "write heights in metres, one row per line");
    }
    grid.heights_m.push_back(*value);
    ++columns;
    word.clear();
  };
  const auto end_line = [&] {
    end_word();
    if (columns > 0) {
      if (grid.rows > 0 && columns != grid.columns) {
        RefuseHeights(path, "line " + std::to_string(line), std::to_string(columns) + " numbers",
                      "the first row has " + std::to_string(grid.columns), "give all rows the same length");
      }
      grid.columns = columns;
      ++grid.rows;
      if (std::max(grid.columns, grid.rows) > kMaxSamples) CheckGridSize(path, grid.columns, grid.rows);
    }
    columns = 0;
    ++line;
  };
  bool comment = false;
  for (const char c : text) {
    if (c == '\n') {
      end_line();
      comment = false;
    } else if (c == '#' || comment) {
      comment = true;
    } else if (c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r') {
      end_word();
    } else {
      word += c;
    }
  }
  end_line();
  CheckGridSize(path, grid.columns, grid.rows);
  return grid;
}

}  // namespace

bool IsHeightMapFile(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 4> kSuffixes = {".png", ".pgm", ".txt", ".csv"};
  return std::find(kSuffixes.begin(), kSuffixes.end(), SuffixOf(path)) != kSuffixes.end();
}

bool HasMetres(const std::filesystem::path& path) { return SuffixOf(path) == ".txt" || SuffixOf(path) == ".csv"; }

HeightGrid ReadHeightGrid(const std::string& path) {
  const std::string bytes = ReadFileText(path, kMaxHeightMapBytes);
  const std::string suffix = SuffixOf(path);
  if (suffix == ".png") return ReadPng(path, bytes);
  if (suffix == ".pgm") return PgmReader(path, bytes).Read();
  return ReadNumbers(path, bytes);
}

TriangleMesh SolidBelow(const HeightGrid& grid, const Eigen::Vector3d& scale) {
  constexpr double kFloor_m = 0.5;
  TriangleMesh mesh;
  double lowest_m = std::numeric_limits<double>::infinity();
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double z =
          scale.z() * grid.heights_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                                     static_cast<std::size_t>(column)];
      lowest_m = std::min(lowest_m, z);
      mesh.vertices.emplace_back(scale.x() * (static_cast<double>(column) / (grid.columns - 1) - 0.5),
                                 scale.y() * (0.5 - static_cast<double>(row) / (grid.rows - 1)), z);
    }
  }
  const auto at = [&](int row, int column) { return row * grid.columns + column; };
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + 1 < grid.columns; ++column) {
      mesh.triangles.push_back({at(row, column), at(row + 1, column), at(row + 1, column + 1)});
      mesh.triangles.push_back({at(row, column), at(row + 1, column + 1), at(row, column + 1)});
    }
  }
  std::vector<int> rim;  // counter-clockwise seen from above
  for (int column = 0; column + 1 < grid.columns; ++column) rim.push_back(at(grid.rows - 1, column));
  for (int row = grid.rows - 1; row > 0; --row) rim.push_back(at(row, grid.columns - 1));
  for (int column = grid.columns - 1; column > 0; --column) rim.push_back(at(0, column));
  for (int row = 0; row + 1 < grid.rows; ++row) rim.push_back(at(row, 0));
  const int centre = static_cast<int>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.0, 0.0, lowest_m - kFloor_m);
  for (const int v : rim) {
    const Eigen::Vector3d top = mesh.vertices[static_cast<std::size_t>(v)];
    mesh.vertices.emplace_back(top.x(), top.y(), lowest_m - kFloor_m);
  }
  const int corners = static_cast<int>(rim.size());
  for (int k = 0; k < corners; ++k) {
    const int next = (k + 1) % corners;
    const int below = centre + 1 + k, below_next = centre + 1 + next;
    const int top = rim[static_cast<std::size_t>(k)], top_next = rim[static_cast<std::size_t>(next)];
    mesh.triangles.push_back({top, below, below_next});
    mesh.triangles.push_back({top, below_next, top_next});
    mesh.triangles.push_back({centre, below_next, below});
  }
  return mesh;
}

}  // namespace legopt
