#include "bus/bridge/access_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "bus/bridge/link_socket.h"
#include "bus/bus_error.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"

namespace legopt::bridge {
namespace {

using bus::BusError;
using bus::BusErrorCode;

constexpr const char* kFirstLine = "legopt-access 1";
constexpr std::size_t kMaxAddresses = 64;
constexpr std::size_t kLongestLine = 200;
constexpr std::size_t kMostFileBytes = 2 * kMaxAddresses * kLongestLine;

[[noreturn]] void Refuse(const std::string& file, const std::string& why) {
  throw BusError(BusErrorCode::kInvalidOption, "access file " + file + ": " + why);
}

std::string TextOf(const Access& access) {
  std::string text = std::string(kFirstLine) + "\ndeployment " + std::to_string(access.deployment) + "\n";
  for (const LinkAddress address : access.addresses) text += "address " + ToString(address) + "\n";
  return text;
}

// Parses one line after the first into `access`. Returns its fault; empty if there is none.
std::string TakeLine(const std::string& line, Access& access) {
  const std::size_t space = line.find(' ');
  const std::string word = line.substr(0, space);
  const std::string value = space == std::string::npos ? "" : line.substr(space + 1);
  if (word == "deployment") {
    if (access.deployment != 0) return "a second deployment";
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), access.deployment);
    if (error != std::errc{} || end != value.data() + value.size() || access.deployment < 1) {
      return "'" + value + "' is no deployment number";
    }
    return "";
  }
  if (word != "address") return "unknown word '" + word + "'";
  if (access.addresses.size() == kMaxAddresses) return "more than " + std::to_string(kMaxAddresses) + " addresses";
  try {
    access.addresses.push_back(ParseLinkAddress(value));
  } catch (const BusError& error) {
    return error.what();
  }
  return "";
}

// Reads at most kMostFileBytes, so that an endless file costs no memory.
std::string ContentOf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream && files::IsShortage(errno)) throw std::system_error(errno, std::generic_category(), file);
  if (!stream) Refuse(file, std::string("cannot be read: ") + std::strerror(errno));
  std::string text(kMostFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMostFileBytes) Refuse(file, "is larger than any access file; check that it is the right one");
  return text;
}

// Returns the first line without its line end and removes both from `text`.
std::string_view TakeFirstLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

}  // namespace

std::string ListOf(const std::vector<LinkAddress>& addresses) {
  std::string list;
  for (const LinkAddress address : addresses) list += (list.empty() ? "" : ", ") + ToString(address);
  return list;
}

void WriteAccessFile(const std::string& file, const Access& access) {
  std::error_code ignored;
  if (std::filesystem::is_symlink(file, ignored) && !files::IsStream(file)) {
    Refuse(file, "is a symbolic link, which may lead to a file of another program; remove it or name another file");
  }
  try {
    files::ReplaceFile(file, TextOf(access), {files::kReadableByOwner, files::Durability::kSynced});
  } catch (const files::FileError& error) {
    if (error.shortage()) throw;
    Refuse(file, error.reason());
  }
}

Access ReadAccessFile(const std::string& file) {
  const std::string text = ContentOf(file);
  std::string_view rest = text;
  if (TakeFirstLine(rest) != kFirstLine) {
    Refuse(file, "not an access file of this release; 'legopt-server --listen' writes one");
  }
  Access access;
  for (int number = 2; !rest.empty(); ++number) {
    const std::string line(TakeFirstLine(rest));
    if (line.empty() || line[0] == '#') continue;
    const std::string fault = line.size() > kLongestLine ? "too long" : TakeLine(line, access);
    if (!fault.empty()) Refuse(file, "line " + std::to_string(number) + ": " + fault);
  }
  if (access.deployment == 0) Refuse(file, "names no deployment");
  if (access.addresses.empty()) Refuse(file, "names no address");
  return access;
}

}  // namespace legopt::bridge
