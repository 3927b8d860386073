#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <ist/gpu.h>

// What the module itself asks of CUDA, in order of the caller's streams; a build without CUDA has
// other bodies. Errors are ist::Error. Streams are those that DLPack knows: 1 is the legacy default
// one, 2 the thread's own.

struct CUevent_st;

namespace ist::python::cuda {

using Stream = CUstream_st*;

inline Stream legacy_stream() { return reinterpret_cast<Stream>(std::uintptr_t{1}); }

/// When all that a stream was given until now is done.
class Moment {
 public:
  Moment(int device, Stream stream);
  ~Moment();
  Moment(const Moment&) = delete;
  Moment& operator=(const Moment&) = delete;

  bool passed() const;
  void wait() const;               ///< on the host
  void hold(Stream stream) const;  ///< the stream waits: what it is given from now on comes after

 private:
  int device_;
  CUevent_st* event_ = nullptr;
};

/// Device memory for answers. Without `data`: memory that something else owns.
///
/// Whoever drops the last of its owners need not have waited for anything: it is free for others
/// when all that the device had been given by the next allocate() is done.
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

/// Usable by `stream` from now on.
std::shared_ptr<Block> allocate(int device, std::size_t bytes, Stream stream);

/// Sets so many bytes to zero, when the stream comes to it.
void clear(const Block& block, std::size_t bytes, Stream stream);

/// `count` times the same number, for work that the stream is given while this lives.
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

/// The device whose memory this is; −1: of none.
int device_of(const void* memory);

/// Whether the stream's work goes into a graph, to be done later and often.
bool captures(int device, Stream stream);

/// Once `moment` has passed; waits for it.
void copy_to_host(void* to, const void* from, std::size_t bytes, int device, const Moment& moment);

}  // namespace ist::python::cuda
