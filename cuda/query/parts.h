#pragma once

#include <cstddef>

namespace ist::gpu {

/// Takes arrays from a block of memory, one after another.
class Parts {
 public:
  explicit Parts(std::byte* from) : from_(from) {}

  template <class T>
  T* take(std::size_t count) {
    T* const part = reinterpret_cast<T*>(from_ + used_);
    used_ += (count * sizeof(T) + 255) / 256 * 256;
    return part;
  }
  std::size_t used() const { return used_; }

 private:
  std::byte* from_;
  std::size_t used_ = 0;
};

}  // namespace ist::gpu
