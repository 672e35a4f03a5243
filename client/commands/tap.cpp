#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "app/command_line.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/escaped_text.h"
#include "client/service/interrupt.h"
#include "client/tap/captured_datagram.h"
#include "legopt/types/nearest_name.h"

namespace legopt::client {
namespace {

using bus::microseconds;
using std::chrono::duration;

constexpr microseconds kPollSlice = std::chrono::milliseconds(50);
constexpr microseconds kLastLook = std::chrono::seconds(1);
constexpr microseconds kQuiet = std::chrono::milliseconds(300);
constexpr microseconds kPatience = std::chrono::seconds(5);

struct TapOptions {
  NetworkOptions network;
  std::vector<std::string> types;
  std::string from;
  std::optional<std::int64_t> count;
  std::optional<double> seconds;
};

// Stores received datagrams until the tap processes them outside of LCM's callbacks.
class Listener final : public bus::DatagramReceiver {
 public:
  struct Datagram {
    bus::Port port;
    std::vector<std::uint8_t> bytes;
  };

  explicit Listener(bus::Transport& transport) : transport_(transport) {
    transport_.SetReceiver(this, bus::kAnyDestination);
  }
  ~Listener() { transport_.SetReceiver(nullptr, bus::kAnyDestination); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  const std::vector<Datagram>& Listen(microseconds max_wait) {
    heard_.clear();
    transport_.Poll({}, max_wait);
    return heard_;
  }

  void OnDatagram(bus::Port port, std::span<const std::uint8_t> datagram) noexcept override {
    try {
      heard_.push_back({port, {datagram.begin(), datagram.end()}});
    } catch (const std::bad_alloc&) {
      // The datagram is lost, which is normal for datagrams.
    }
  }

 private:
  bus::Transport& transport_;
  std::vector<Datagram> heard_;
};

// Returns nullopt if the word is not an address.
std::optional<bus::EndpointId> ParseAddress(const std::string& word) {
  if (word == "server") return bus::kServer;
  bus::EndpointId address = 0;
  const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), address);
  if (fault != std::errc() || end != word.data() + word.size() || address < 1) return std::nullopt;
  return address;
}

class Filter {
 public:
  explicit Filter(const TapOptions& options)
      : types_(options.types.begin(), options.types.end()), sender_(ParseAddress(options.from)) {}
  bool Takes(const CapturedDatagram& heard) const {
    if (!types_.empty() && !types_.contains(TypeName(heard))) return false;
    return !sender_ || (heard.is_frame && heard.header.sender == *sender_);
  }

 private:
  std::set<std::string, std::less<>> types_;
  std::optional<bus::EndpointId> sender_;
};

std::int64_t WallClock() {
  return std::chrono::duration_cast<microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

double InSeconds(microseconds span) { return duration<double>(span).count(); }

std::string ToLine(const nlohmann::ordered_json& json) { return JsonText(json, -1) + "\n"; }

// A run of the command: listens, prints, and prints a summary at the end.
class TapRun {
 public:
  TapRun(const TapOptions& options, const bus::LcmOptions& network)
      : options_(options),
        address_(network.group + ":" + std::to_string(network.port)),
        transport_(network),
        listener_(transport_),
        filter_(options),
        begin_(transport_.now()) {}

  ExitCode Run() {
    std::cerr << "legopt: listening at " << address_ << (transport_.key() == nullptr ? "" : ", signatures are checked")
              << "; Ctrl-C ends it" << std::endl;
    while (!Over()) {
      Hear();
      SayIfSilent();
    }
    HearWhatHasArrived();
    return Conclude();
  }

 private:
  static microseconds Span(double seconds) {
    return std::chrono::duration_cast<microseconds>(duration<double>(seconds));
  }
  bool Enough() const { return options_.count && printed_ >= *options_.count; }
  bool Over() const {
    if (Interrupted() || Enough()) return true;
    return options_.seconds && transport_.now() - begin_ >= Span(*options_.seconds);
  }

  // Returns true if datagrams were received.
  bool Hear() {
    const auto& heard = listener_.Listen(kPollSlice);
    for (const auto& datagram : heard) {
      if (!Enough()) Take(datagram);
    }
    std::cout.flush();
    return !heard.empty();
  }

  // After an interruption, prints the datagrams received so far; LCM's reader may lag slightly.
  void HearWhatHasArrived() {
    const microseconds end = transport_.now() + kLastLook;
    microseconds heard_at = transport_.now();
    while (Interrupted() && !InterruptedTwice() && !Enough()) {
      if (Hear()) heard_at = transport_.now();
      if (transport_.now() >= std::min(end, heard_at + kQuiet)) return;
    }
  }

  void Take(const Listener::Datagram& datagram) {
    const CapturedDatagram heard =
        ReadDatagram(datagram.port, datagram.bytes, transport_.deployment(), transport_.key());
    ++datagrams_;
    bytes_ += heard.bytes;
    if (!heard.rejected.empty()) ++rejected_[std::string(heard.rejected)];
    if (!filter_.Takes(heard)) return;
    std::cout << ToLine(DatagramToJson(heard, WallClock()));
    ++printed_;
  }

  void SayIfSilent() {
    if (reported_silence_ || datagrams_ > 0 || transport_.now() - begin_ < kPatience) return;
    reported_silence_ = true;
    std::cerr << "legopt: nothing heard yet at " << address_ << "; does a server run there? ('legopt status')"
              << std::endl;
  }

  ExitCode Conclude() {
    if (datagrams_ == 0) {
      throw ClientError(ExitCode::kUnreachable,
                        "nothing was heard at " + address_ +
                            "; is something running there? 'legopt status' asks the server, --port and LEGOPT_PORT "
                            "choose another deployment");
    }
    std::string rejected;
    for (const auto& [cause, count] : rejected_) {
      rejected += (rejected.empty() ? "; rejected: " : ", ") + std::to_string(count) + " " + cause;
    }
    const auto lost = transport_.counters().kernel_drops;
    std::cerr << "legopt: heard " << datagrams_ << " datagrams (" << bytes_ << " bytes) in "
              << InSeconds(transport_.now() - begin_) << " s" << rejected
              << (lost == 0 ? "" : "; " + std::to_string(lost) + " lost on this machine for lack of buffer")
              << std::endl;
    if (printed_ == 0) std::cerr << "legopt: none of them passed --type and --from\n";
    if (rejected_.contains("tag") && transport_.key() == nullptr) {
      std::cerr << "legopt: tags that are wrong without a key may be right under one; --key-file checks\n";
    }
    if (rejected_.contains("tag") && transport_.key() != nullptr &&
        transport_.key()->role() != bus::KeyRole::kOperator) {
      std::cerr << "legopt: a " << ToString(transport_.key()->role())
                << "'s key checks the tags of that role only; the full key checks all\n";
    }
    return ExitCode::kOk;
  }

  const TapOptions& options_;
  std::string address_;
  bus::LcmTransport transport_;
  Listener listener_;
  Filter filter_;
  microseconds begin_;
  std::uint64_t datagrams_ = 0;
  std::uint64_t bytes_ = 0;
  std::map<std::string, std::uint64_t> rejected_;  // key: cause
  std::int64_t printed_ = 0;
  bool reported_silence_ = false;
};

ExitCode Tap(const TapOptions& options) {
  const InterruptGuard guard;
  bus::PrepareHashing();
  bus::LcmOptions network = options.network.Resolve();
  network.hear_all_hosts = true;
  return TapRun(options, network).Run();
}

std::vector<std::string> TypeNames() {
  std::vector<std::string> names;
  for (std::int16_t type = 1; type <= bus::kLastMessageType; ++type) {
    names.emplace_back(bus::ToString(static_cast<bus::MessageType>(type)));
  }
  return names;
}

std::string CheckType(const std::string& word) {
  const std::vector<std::string> names = TypeNames();
  const bool known = std::find(names.begin(), names.end(), word) != names.end();
  return known ? "" : "'" + word + "' is no message type; " + SuggestName(word, names);
}

std::string CheckSender(const std::string& word) {
  return ParseAddress(word) ? "" : "'" + word + "' is neither 'server' nor an address as tap prints it";
}

}  // namespace

void AddTapCommand(const app::Command& program, Invocation* invocation) {
  constexpr double kShortest_s = 0.1, kLongest_s = 1e6;
  const auto command = program.AddCommand("tap", "Show the network traffic of a deployment, one JSON object per line");
  const auto options = std::make_shared<TapOptions>();
  command.AddList("--type", options->types, "Only these message types, e.g. lease,result", {}, {CheckType, ""});
  command.AddOption("--from", options->from, "Only messages from this sender: server, or an address")
      .Check({CheckSender, ""});
  command.AddOption("--count", options->count, "End after so many lines").Check(app::WholeNumber(1));
  command.AddOption("--seconds", options->seconds, "End after so many seconds")
      .Check(app::Number(kShortest_s, kLongest_s));
  app::AddListeningFlags(command, &options->network);
  command.SetFooter(
      "It only listens: it sends nothing and prints no key. Bodies above one datagram are shown as chunks.\n"
      "'legopt status -v' shows the server's counters of requests and datagrams.");
  command.WhenChosen([=] { invocation->body = [options] { return Tap(*options); }; });
}

}  // namespace legopt::client
