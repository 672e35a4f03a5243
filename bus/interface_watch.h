#pragma once

/// @file
/// Changes of interfaces, addresses and routes. Private to bus.

namespace legopt::bus {

/// A subscription to the kernel's notices (rtnetlink) for the network namespace in which it was made. Where the kernel
/// refuses it, it reports nothing. Thread rule: one thread.
class InterfaceWatch {
 public:
  InterfaceWatch();
  ~InterfaceWatch();
  InterfaceWatch(const InterfaceWatch&) = delete;
  InterfaceWatch& operator=(const InterfaceWatch&) = delete;

  int descriptor() const { return fd_; }  ///< readable after a change; -1: none
  /// Whether anything has changed since the last call.
  bool TakeChanges() const;

 private:
  int fd_;
};

}  // namespace legopt::bus
