#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <ist/gpu.h>

// The CUDA functions that the module itself uses, in order of the caller's streams; a build without
// CUDA has other definitions. Errors are ist::Error. Streams are numbered as in DLPack: 1 is the
// legacy default stream, 2 the thread's own.

struct CUevent_st;

namespace ist::python::cuda {

using Stream = CUstream_st*;

inline Stream legacy_stream() { return reinterpret_cast<Stream>(std::uintptr_t{1}); }

/// The end of all work given to a stream so far.
class Moment {
 public:
  Moment(int device, Stream stream);
  ~Moment();
  Moment(const Moment&) = delete;
  Moment& operator=(const Moment&) = delete;

  bool passed() const;
  void wait() const;               ///< on the host
  void hold(Stream stream) const;  ///< the stream waits: work given to it from now on comes after

 private:
  int device_;
  CUevent_st* event_ = nullptr;
};

/// Device memory for answers. Without `data`: memory with another owner.
///
/// Its last owner need not wait before dropping it: others may use it once all work that the device
/// had been given by the next allocate() is done.
class Block {
 public:
  Block(int device, void* data) : device_(device), data_(data) {}
  ~Block();
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  int device() const { return device_; }
  std::byte* data() const { return static_cast<std::byte*>(data_); }

 private:
  int device_;
  void* data_;
};

/// The result is usable by `stream` from now on.
std::shared_ptr<Block> allocate(int device, std::size_t bytes, Stream stream);

/// Sets so many bytes to zero, in the stream's order.
void clear(const Block& block, std::size_t bytes, Stream stream);

/// An array of `count` equal numbers, for work given to the stream during this object's lifetime.
class Repeated {
 public:
  Repeated(int device, std::uint32_t number, std::size_t count, Stream stream);
  ~Repeated();
  Repeated(const Repeated&) = delete;
  Repeated& operator=(const Repeated&) = delete;

  const std::uint32_t* data() const { return static_cast<const std::uint32_t*>(data_); }

 private:
  int device_;
  Stream stream_;
  void* data_ = nullptr;
};

/// The device that owns this memory; −1: none.
int device_of(const void* memory);

/// True if the stream's work is captured into a graph.
bool captures(int device, Stream stream);

/// Copies after `moment`, and waits for it.
void copy_to_host(void* to, const void* from, std::size_t bytes, int device, const Moment& moment);

}  // namespace ist::python::cuda
