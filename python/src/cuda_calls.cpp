#include "cuda_calls.h"

#include <cuda.h>
#include <cudaTypedefs.h>
#include <cuda_runtime_api.h>
#include <ist/types.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "cuda/base/check.h"
#include "cuda/base/queue.h"

namespace ist::python::cuda {
namespace {

using gpu::check;
using gpu::DeviceGuard;

/// A function of the driver, loaded at run time, so that the module loads without a driver.
template <class Function>
Function driver_function(const char* name, unsigned version) {
  void* found = nullptr;
  cudaDriverEntryPointQueryResult result = cudaDriverEntryPointSuccess;
  check(cudaGetDriverEntryPointByVersion(name, &found, version, cudaEnableLegacyStream, &result),
        "loading a driver function");
  if (result != cudaDriverEntryPointSuccess || found == nullptr)
    throw Error(std::string("GPU: the driver has no ") + name + ": install one for CUDA 13");
  return reinterpret_cast<Function>(found);
}

void check_driver(CUresult result, const char* doing) {
  if (result != CUDA_SUCCESS)
    throw Error(std::string("GPU: ") + doing + ": driver error " + std::to_string(result));
}

/// Blocks without an owner, and the stream that frees them.
///
/// The last reader of a block and its stream are unknown, and the stream may be gone. So a block is
/// freed in the order of all work of the device, not when it is dropped (a graph may be captured
/// then) but at the next allocation.
class Dropped {
 public:
  void add(void* data) {
    const std::lock_guard lock(mutex_);
    data_.push_back(data);
  }

  /// The device must be current.
  void free_all() {
    const std::lock_guard lock(mutex_);
    if (data_.empty()) return;
    if (stream_ == nullptr)
      check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
    static const auto current = driver_function<PFN_cuCtxGetCurrent_v4000>("cuCtxGetCurrent", 4000);
    static const auto record =
        driver_function<PFN_cuCtxRecordEvent_v12050>("cuCtxRecordEvent", 12050);
    CUcontext context = nullptr;
    check_driver(current(&context), "querying the device's context");
    cudaEvent_t all = nullptr;
    check(cudaEventCreateWithFlags(&all, cudaEventDisableTiming), "making an event");
    const CUresult recorded = record(context, all);
    if (recorded == CUDA_SUCCESS) {
      cudaStreamWaitEvent(stream_, all, 0);
      for (void* data : data_) cudaFreeAsync(data, stream_);
      data_.clear();
    }
    cudaEventDestroy(all);
    check_driver(recorded, "freeing unused answers");
  }

  /// One per process, never destroyed: blocks may outlive the interpreter.
  static Dropped& of(int device) {
    static std::mutex mutex;
    static auto* const all = new std::map<int, Dropped>;
    const std::lock_guard lock(mutex);
    return (*all)[device];
  }

 private:
  std::mutex mutex_;
  std::vector<void*> data_;
  cudaStream_t stream_ = nullptr;
};

void* allocated(std::size_t bytes, Stream stream) {
  void* data = nullptr;
  const cudaError_t status = cudaMallocAsync(&data, bytes, stream);
  if (status == cudaErrorMemoryAllocation) {
    cudaGetLastError();
    throw Error("GPU: no device memory left for " + std::to_string(bytes) +
                " bytes of a batch: free device memory, split the batch, or request fewer answers");
  }
  check(status, "allocating device memory");
  return data;
}

}  // namespace

Moment::Moment(int device, Stream stream) : device_(device) {
  const DeviceGuard guard(device);
  check(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "making an event");
  const cudaError_t status = cudaEventRecord(event_, stream);
  if (status != cudaSuccess) cudaEventDestroy(event_);
  check(status, "recording an event on the stream");
}

Moment::~Moment() { cudaEventDestroy(event_); }

bool Moment::passed() const {
  const cudaError_t status = cudaEventQuery(event_);
  if (status == cudaErrorNotReady) {
    cudaGetLastError();
    return false;
  }
  check(status, "querying whether a batch is done");
  return true;
}

void Moment::wait() const { check(cudaEventSynchronize(event_), "waiting for a batch"); }

void Moment::hold(Stream stream) const {
  const DeviceGuard guard(device_);
  check(cudaStreamWaitEvent(stream, event_, 0), "making a stream wait for a batch");
}

Block::~Block() {
  if (data_ != nullptr) Dropped::of(device_).add(data_);
}

std::shared_ptr<Block> allocate(int device, std::size_t bytes, Stream stream) {
  const DeviceGuard guard(device);
  Dropped::of(device).free_all();
  return std::make_shared<Block>(device, allocated(bytes, stream));
}

void clear(const Block& block, std::size_t bytes, Stream stream) {
  const DeviceGuard guard(block.device());
  check(cudaMemsetAsync(block.data(), 0, bytes, stream), "clearing device memory");
}

Repeated::Repeated(int device, std::uint32_t number, std::size_t count, Stream stream)
    : device_(device), stream_(stream) {
  if (count == 0) return;
  const DeviceGuard guard(device);
  static const auto fill = driver_function<PFN_cuMemsetD32Async_v3020>("cuMemsetD32Async", 3020);
  data_ = allocated(count * sizeof number, stream);
  const CUresult filled = fill(reinterpret_cast<CUdeviceptr>(data_), number, count, stream);
  if (filled != CUDA_SUCCESS) cudaFreeAsync(data_, stream);
  check_driver(filled, "filling device memory");
}

Repeated::~Repeated() {
  if (data_ == nullptr) return;
  int before = 0;
  cudaGetDevice(&before);
  cudaSetDevice(device_);
  cudaFreeAsync(data_, stream_);
  cudaSetDevice(before);
}

int device_of(const void* memory) {
  cudaPointerAttributes found = {};
  if (cudaPointerGetAttributes(&found, memory) != cudaSuccess) {
    cudaGetLastError();
    return -1;
  }
  const bool fits = found.type == cudaMemoryTypeDevice || found.type == cudaMemoryTypeManaged;
  return fits ? found.device : -1;
}

bool captures(int device, Stream stream) {
  if (stream == legacy_stream())
    return false;  // it cannot, and must not be queried while others capture
  const DeviceGuard guard(device);
  cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
  check(cudaStreamIsCapturing(stream, &status), "querying a stream's state");
  return status != cudaStreamCaptureStatusNone;
}

void copy_to_host(void* to, const void* from, std::size_t bytes, int device, const Moment& moment) {
  const DeviceGuard guard(device);
  moment.wait();
  check(cudaMemcpy(to, from, bytes, cudaMemcpyDeviceToHost), "copying answers to the host");
}

}  // namespace ist::python::cuda
