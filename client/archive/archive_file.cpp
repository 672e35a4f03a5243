#include "client/archive/archive_file.h"

#include <zstd.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "client/archive/archive_fields.h"
#include "client/client_error.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"
#include "legopt/types/invariant.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic = "legopt-archive ";
constexpr int kFormat = 1;
constexpr std::size_t kMaxNumbers = 100'000'000;  // 800 MB

std::string Compressed(const std::string& plain) {
  constexpr int kLevel = 9;
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kLevel);
  CheckInvariant(ZSTD_isError(size) == 0, "compressed data fit the bound of the compressor");
  packed.resize(size);
  return packed;
}

std::string Uncompressed(std::string_view packed, const std::string& source) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    throw InputError({source, "results", "", "are not compressed by zstd", "get the file again"});
  }
  // Text of numbers shrinks to a third or a half, that of equal lines to a hundredth.
  constexpr std::size_t kAlwaysUnpacked = std::size_t{64} << 20, kMaxExpansion = 200;
  if (size > kMaxArchiveText || size > kAlwaysUnpacked + kMaxExpansion * packed.size()) {
    throw InputError({source, "results", std::to_string(size) + " bytes unpacked",
                      "are larger than an archive may be, " + std::to_string(kMaxArchiveText) + " bytes",
                      "split the experiment"});
  }
  std::string plain(static_cast<std::size_t>(size), '\0');
  const std::size_t got = ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0 || got != plain.size()) {
    throw InputError({source, "results", "", "cannot be unpacked", "get the file again"});
  }
  return plain;
}

// Takes the text up to the next line end off `rest`; everything if there is none.
std::string_view TakeLine(std::string_view* rest) {
  const std::size_t end = rest->find('\n');
  const std::string_view line = rest->substr(0, end);
  rest->remove_prefix(end == std::string_view::npos ? rest->size() : end + 1);
  return line;
}

// Checks the first line, "legopt-archive 1 HASH", takes it off and returns HASH.
std::string CheckFirstLine(std::string_view* rest, const std::string& source) {
  if (!rest->starts_with(kMagic)) {
    throw InputError({source, "", "", "is no archive of legopt", "'legopt archive pack' makes one"});
  }
  std::string_view line = TakeLine(rest);
  line.remove_prefix(kMagic.size());
  const std::size_t space = line.find(' ');
  const std::string format(line.substr(0, space));
  const std::optional<int> number = ParseInteger<int>(format);
  if (!number || *number < kFormat) {
    throw InputError(
        {source, "format", format.substr(0, 64), "is no format of archives", "'legopt archive pack' makes one"});
  }
  if (*number != kFormat) {
    throw InputError({source, "format", format,
                      "is newer than this legopt, which reads format " + std::to_string(kFormat),
                      "use a newer legopt"});
  }
  const std::string hash(space == std::string_view::npos ? "" : line.substr(space + 1));
  if (!IsBlake2bHex(hash) || Blake2bHex(*rest) != hash) {
    throw InputError({source, "hash", hash.substr(0, 64), "is not that of the content: the file is damaged or changed",
                      "get it again"});
  }
  return hash;
}

void RefuseTwice(const Archive& archive, const ArchivedResult& result, const std::string& source, std::size_t line,
                 std::map<JobKey, std::size_t>* lines) {
  const JobKey key{result.method, result.task, result.initialization, result.problem, result.repetition};
  const auto [first, fresh] = lines->emplace(key, line);
  if (fresh) return;
  throw InputError({source, "result " + std::to_string(line),
                    archive.methods[result.method].name + ", " + std::string(ToString(result.task)) + " " +
                        std::to_string(result.problem) + ", " + std::string(ToString(result.initialization)) +
                        ", repetition " + std::to_string(result.repetition),
                    "is of the same job as result " + std::to_string(first->second), "keep one of them"});
}

}  // namespace

std::int64_t Archive::num_jobs() const {
  std::size_t problems = 0;
  for (const ArchivedTask& task : tasks) problems += task.problems.size();
  return static_cast<std::int64_t>(problems * methods.size() * initializations.size()) * repetitions;
}

std::string EncodeArchive(const Archive& archive) {
  std::string lines;
  for (const ArchivedResult& result : archive.results) lines += Dump(ResultFields(result)) + "\n";
  if (lines.size() > kMaxArchiveText) {
    throw ClientError(ExitCode::kUsage, "the results have " + std::to_string(lines.size()) +
                                            " bytes as text, more than an archive may have (" +
                                            std::to_string(kMaxArchiveText) + "); split the experiment");
  }
  const std::string content = Dump(HeaderFields(archive)) + "\n" + Compressed(lines);
  return std::string(kMagic) + std::to_string(kFormat) + " " + Blake2bHex(content) + "\n" + content;
}

Archive DecodeArchive(std::string_view bytes, const std::string& source) {
  std::string_view rest = bytes;
  const std::string hash = CheckFirstLine(&rest, source);
  const std::string_view header = TakeLine(&rest);
  constexpr std::size_t kMaxLine = std::size_t{64} << 20;
  Archive archive = HeaderOf(ParseOrderedJson(header, source + ": header", {.bytes = kMaxLine}), source);
  archive.hash = hash;
  const std::string text = Uncompressed(rest, source);
  std::string_view lines = text;
  std::map<JobKey, std::size_t> seen;
  std::size_t numbers = 0;  // count over all solutions
  while (!lines.empty()) {
    const std::size_t number = archive.results.size() + 1;
    const std::string place = source + ": result " + std::to_string(number);
    const Json fields = ParseOrderedJson(TakeLine(&lines), place, {.bytes = kMaxLine});
    archive.results.push_back(ResultOf(fields, archive, place));
    RefuseTwice(archive, archive.results.back(), source, number, &seen);
    for (const Eigen::VectorXd& waypoint : archive.results.back().waypoints)
      numbers += static_cast<std::size_t>(waypoint.size()) + 1;
    if (numbers > kMaxNumbers) {
      throw InputError({place, "x", "",
                        "with the solutions before it has more than " + std::to_string(kMaxNumbers) + " numbers",
                        "split the experiment"});
    }
  }
  return archive;
}

Archive ReadArchive(const std::filesystem::path& path) {
  return DecodeArchive(ReadFileText(path, kMaxArchiveBytes), path.string());
}

}  // namespace legopt::client
