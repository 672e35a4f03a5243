#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace legopt {

/// Puts what a guarded read (read_guard.h) found into the bytes that it answers: a letter for the kind of answer, then
/// sequences of trivially copyable values, each with its count. Both sides are one program, so that nothing is
/// converted.
class AnswerWriter {
 public:
  /// Begins an answer with the letter of its kind, which the reader of the other side takes off before AnswerReader.
  explicit AnswerWriter(char kind) : bytes_(1, kind) {}

  /// Appends the number of values (64 bits) and their bytes. `Sequence`: contiguous, of trivially copyable values.
  template <typename Sequence>
  void Add(const Sequence& values) {
    const std::uint64_t count = values.size();
    bytes_.append(reinterpret_cast<const char*>(&count), sizeof(count));
    bytes_.append(reinterpret_cast<const char*>(values.data()), count * sizeof(*values.data()));
  }

  std::string Take() { return std::move(bytes_); }  ///< the answer; ends the writer's use

 private:
  std::string bytes_;
};

/// Takes the sequences out again. The answering process may have been corrupted: its answer is checked like any other
/// input, and so must be the values by whoever reads them.
class AnswerReader {
 public:
  /// `bytes`: the answer without its first letter; outlives this.
  explicit AnswerReader(std::string_view bytes) : rest_(bytes) {}

  /// False when there is no whole sequence.
  template <typename Sequence>
  bool Read(Sequence& values) {
    std::uint64_t count = 0;
    if (rest_.size() < sizeof(count)) return false;
    std::memcpy(&count, rest_.data(), sizeof(count));
    rest_.remove_prefix(sizeof(count));
    if (count > rest_.size() / sizeof(*values.data())) return false;
    values.resize(count);
    const std::size_t size = count * sizeof(*values.data());
    if (size > 0) std::memcpy(static_cast<void*>(values.data()), rest_.data(), size);
    rest_.remove_prefix(size);
    return true;
  }

  bool at_end() const { return rest_.empty(); }  ///< true when nothing is left: a sound answer ends here

 private:
  std::string_view rest_;
};

}  // namespace legopt
