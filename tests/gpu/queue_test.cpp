#include "queue.h"

#include <ist/error.h>

#include <numeric>
#include <vector>

#include "device_array.h"
#include "support/gpu_test.h"

namespace ist {
namespace {

using gpu::DeviceArray;
using gpu::Queue;

class QueueTest : public testing::GpuTest {};

/// Gives out no more than so many bytes.
class ScarceMemory final : public DeviceMemoryResource {
 public:
  explicit ScarceMemory(std::size_t bytes) : left_(bytes) {}
  void* allocate(std::size_t bytes, CUstream_st* stream) override {
    if (bytes > left_) return nullptr;
    void* memory = nullptr;
    if (cudaMallocAsync(&memory, bytes, stream) != cudaSuccess) return nullptr;
    left_ -= bytes;
    return memory;
  }
  void deallocate(void* memory, std::size_t bytes, CUstream_st* stream) noexcept override {
    cudaFreeAsync(memory, stream);
    left_ += bytes;
  }
  std::size_t left() const { return left_; }

 private:
  std::size_t left_;
};

TEST_F(QueueTest, ArraysTravelThereAndBackAndGrow) {
  Queue queue{GpuSettings{}};
  std::vector<int> sent(100000);
  std::iota(sent.begin(), sent.end(), 7);
  DeviceArray<int> array(queue, sent.size());
  array.upload(sent);
  EXPECT_EQ(array.to_host(sent.size()), sent);
  array.grow(3 * sent.size(), sent.size());
  EXPECT_EQ(array.size(), 3 * sent.size());
  EXPECT_EQ(array.to_host(sent.size()), sent);
  EXPECT_EQ(queue.bytes_in_use(), 3 * sent.size() * sizeof(int));
  array.release();
  EXPECT_EQ(queue.bytes_in_use(), 0u);
  EXPECT_EQ(queue.peak_bytes(), 4 * sent.size() * sizeof(int));
}

TEST_F(QueueTest, AnEndOfMemoryIsAnErrorWithAWayOutAndLeaksNothing) {
  ScarceMemory memory(1000);
  GpuSettings settings;
  settings.memory = &memory;
  Queue queue(settings);
  {
    const DeviceArray<char> fits(queue, 900);
    try {
      const DeviceArray<char> too_large(queue, 200);
      FAIL() << "200 bytes of 100 left";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("--device cpu"), std::string::npos) << error.what();
    }
  }
  queue.wait();
  EXPECT_EQ(memory.left(), 1000u);
}

TEST_F(QueueTest, ADeviceThatIsNotThereIsAnErrorWithAWayOut) {
  GpuSettings settings;
  settings.device = 1000;
  try {
    const Queue queue(settings);
    FAIL() << "there is no GPU of index 1000";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("--device cpu"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ist
