#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

namespace ist {

/// An uninitialised array for threads to fill: clearing a large array first takes one thread as
/// long as all threads take to fill it.
template <class T>
class RawArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  RawArray() = default;
  explicit RawArray(std::size_t size)
      : items_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}

  RawArray(RawArray&& from) noexcept
      : items_(std::move(from.items_)), size_(std::exchange(from.size_, 0)) {}
  RawArray& operator=(RawArray&& from) noexcept {
    items_ = std::move(from.items_);
    size_ = std::exchange(from.size_, 0);
    return *this;
  }

  std::size_t size() const { return size_; }
  T* data() { return items_.get(); }
  const T* data() const { return items_.get(); }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  T& operator[](std::size_t i) { return items_[i]; }
  const T& operator[](std::size_t i) const { return items_[i]; }

 private:
  std::unique_ptr<T[]> items_;
  std::size_t size_ = 0;
};

}  // namespace ist
