#pragma once

/// @file
/// Detects changes of interfaces, addresses and routes. Private to bus.

namespace legopt::bus {

/// Subscription to the kernel's notices (rtnetlink) for the network namespace in which it was created. Reports no
/// changes if the kernel refuses the subscription. Thread rule: one thread.
class InterfaceWatch {
 public:
  InterfaceWatch();
  ~InterfaceWatch();
  InterfaceWatch(const InterfaceWatch&) = delete;
  InterfaceWatch& operator=(const InterfaceWatch&) = delete;

  int descriptor() const { return fd_; }  ///< readable after a change; -1: no subscription
  /// Returns whether anything has changed since the last call.
  bool TakeChanges() const;

 private:
  int fd_;
};

}  // namespace legopt::bus
