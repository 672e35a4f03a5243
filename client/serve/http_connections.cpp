#include "client/serve/http_connections.h"

#include <netinet/in.h>

#include <algorithm>

namespace legopt::client {
namespace {

// Returns the bytes that identify a visitor.
std::string AddressOf(const sockaddr* from) {
  if (from->sa_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in*>(from)->sin_addr;
    return {reinterpret_cast<const char*>(&v4), sizeof(v4)};
  }
  if (from->sa_family == AF_INET6) {
    constexpr std::size_t kNetworkBytes = 8;
    const auto& v6 = reinterpret_cast<const sockaddr_in6*>(from)->sin6_addr;
    return {reinterpret_cast<const char*>(&v6), kNetworkBytes};
  }
  return {};
}

void CountDown(std::map<std::string, unsigned>* counts, const std::string& address) {
  const auto found = counts->find(address);
  if (found != counts->end() && --found->second == 0) counts->erase(found);
}

}  // namespace

// The HTTP library notices the end of the connection, closes it and calls Remove. Meanwhile the limits do not count it.
void HttpConnections::Close(Entry* entry) {
  entry->waiting = false;
  entry->closed = true;
  ++closed_;
  CountDown(&connections_of_, entry->address);
  shutdown(entry->socket, SHUT_RDWR);
}

unsigned HttpConnections::CountOf(const std::string& address) const {
  const auto found = connections_of_.find(address);
  return found == connections_of_.end() ? 0 : found->second;
}

bool HttpConnections::Admits(const sockaddr* from) {
  const std::lock_guard lock(mutex_);
  return entries_.size() + 1 < capacity() && CountOf(AddressOf(from)) < limits_.most_of_address + kSpare / 2;
}

void HttpConnections::CloseOldestWaiting(const std::string* address) {
  const auto oldest = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return entry.waiting && (address == nullptr || entry.address == *address); });
  if (oldest != entries_.end()) Close(&*oldest);
}

HttpConnections::Entry* HttpConnections::Add(int socket, const sockaddr* from) {
  const std::lock_guard lock(mutex_);
  const std::string address = AddressOf(from);
  if (CountOf(address) >= limits_.most_of_address) CloseOldestWaiting(&address);
  if (entries_.size() - closed_ >= limits_.most_connections) CloseOldestWaiting(nullptr);
  ++connections_of_[address];
  entries_.push_back({socket, address, true, false, Clock::now()});
  return &entries_.back();
}

void HttpConnections::Remove(Entry* entry) {
  const std::lock_guard lock(mutex_);
  if (entry->closed) {
    --closed_;
  } else {
    CountDown(&connections_of_, entry->address);
  }
  entries_.remove_if([entry](const Entry& one) { return &one == entry; });
}

bool HttpConnections::BeginAnswer(Entry* entry) {
  const std::lock_guard lock(mutex_);
  entry->waiting = false;
  return entries_.size() - closed_ <= limits_.most_connections && CountOf(entry->address) <= limits_.most_of_address;
}

void HttpConnections::EndAnswer(Entry* entry) {
  const std::lock_guard lock(mutex_);
  entry->waiting = !entry->closed;
  entry->since = Clock::now();
}

bool HttpConnections::OpenStream(const std::string& address) {
  const std::lock_guard lock(mutex_);
  unsigned& of_address = streams_of_[address];
  if (streams_ >= limits_.most_streams || of_address >= limits_.most_streams_of_address) {
    if (of_address == 0) streams_of_.erase(address);
    return false;
  }
  ++of_address;
  ++streams_;
  return true;
}

void HttpConnections::CloseStream(const std::string& address) {
  const std::lock_guard lock(mutex_);
  CountDown(&streams_of_, address);
  --streams_;
}

unsigned HttpConnections::streams() const {
  const std::lock_guard lock(mutex_);
  return streams_;
}

void HttpConnections::CloseLate(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (Entry& entry : entries_) {
    if (entry.waiting && now - entry.since > limits_.head) Close(&entry);
  }
}

}  // namespace legopt::client
