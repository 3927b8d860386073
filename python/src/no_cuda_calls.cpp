// A build without CUDA: no memory is on a device, so callers fail with an explanation before they
// need one.
#include <ist/types.h>

#include "cuda_calls.h"

namespace ist::python::cuda {

Moment::Moment(int device, Stream) : device_(device) { gpu_info(device); }
Moment::~Moment() = default;
bool Moment::passed() const { return event_ == nullptr; }
void Moment::wait() const {}
void Moment::hold(Stream) const { gpu_info(device_); }

Block::~Block() = default;

std::shared_ptr<Block> allocate(int device, std::size_t, Stream) {
  gpu_info(device);
  return nullptr;
}
void clear(const Block&, std::size_t, Stream) {}

Repeated::Repeated(int device, std::uint32_t, std::size_t, Stream stream)
    : device_(device), stream_(stream) {
  gpu_info(device_);
}
Repeated::~Repeated() = default;

int device_of(const void*) { return -1; }
bool captures(int, Stream) { return false; }
void copy_to_host(void*, const void*, std::size_t, int device, const Moment&) { gpu_info(device); }

}  // namespace ist::python::cuda
